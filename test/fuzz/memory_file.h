#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include <sys/mman.h>
#include <unistd.h>

namespace slender::test {

/// A file in memory, for readers that take a path.
class MemoryFile
{
public:
  /// `ending`: of the name, with its dot; what it links to is the same file.
  explicit MemoryFile(const std::string& ending) : descriptor_(memfd_create("fuzz", 0))
  {
    path_ = "/tmp/slender_sim_fuzz_" + std::to_string(getpid()) + ending;
    unlink(path_.c_str());
    if (symlink(("/proc/self/fd/" + std::to_string(descriptor_)).c_str(), path_.c_str()) != 0)
      std::abort();
  }
  ~MemoryFile()
  {
    unlink(path_.c_str());
    close(descriptor_);
  }
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

}  // namespace slender::test
