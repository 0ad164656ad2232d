#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

namespace slender::test {

/// A file in memory, for readers that take a path.
class MemoryFile
{
public:
  /// `name`: a link of this name leads to it, in a folder that all of one program share.
  explicit MemoryFile(const std::string& name) : descriptor_(memfd_create("fuzz", 0))
  {
    const std::string folder = "/tmp/slender_sim_fuzz_" + std::to_string(getpid());
    mkdir(folder.c_str(), 0700);
    path_ = folder + "/" + name;
    if (symlink(("/proc/self/fd/" + std::to_string(descriptor_)).c_str(), path_.c_str()) != 0)
      std::abort();
  }
  ~MemoryFile()
  {
    unlink(path_.c_str());
    close(descriptor_);
    rmdir(path_.substr(0, path_.rfind('/')).c_str());   // once it is empty
  }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  const std::string& path() const { return path_; }
  void write(const std::uint8_t* data, std::size_t size)
  {
    if (ftruncate(descriptor_, 0) != 0 || pwrite(descriptor_, data, size, 0) != static_cast<ssize_t>(size))
      std::abort();
  }

private:
  int descriptor_;
  std::string path_;
};

}   // namespace slender::test
