#include "slender_sim/scene/file_paths.h"

#include <filesystem>
#include <fstream>
#include <vector>

namespace slender {

namespace fs = std::filesystem;

namespace {

/// `status` with links followed.
void requireRegular(const std::string& path, const fs::file_status& status)
{
  if (fs::is_directory(status))
    throw std::runtime_error(path + ": is a directory; name a file");
  if (!fs::is_regular_file(status))
    throw std::runtime_error(path + ": is no regular file but a device, FIFO or socket; name another file");
}

}   // namespace

void makeFolder(const std::string& folder)
{
  std::error_code error;
  fs::create_directories(folder, error);
  if (!fs::is_directory(folder))
    throw std::runtime_error(folder + ": cannot be made a folder" + (error ? ": " + error.message() : ""));
}

std::string replaceablePath(const std::string& path)
{
  std::error_code error;
  const bool link = fs::is_symlink(fs::symlink_status(path, error));
  const fs::file_status status = fs::status(path, error);
  if (!fs::exists(status))   // or a folder of it may not be read: opening it will tell
  {
    if (link)
    {
      throw std::runtime_error(
          path +
          ": is a symbolic link that leads nowhere, or where this may not look; remove it, or name another file");
    }
    return path;
  }
  requireRegular(path, status);
  return link ? fs::canonical(path).string() : path;
}

void requireRegularFile(const std::string& path)
{
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (fs::exists(status))
    requireRegular(path, status);
}

void clearEarlierRun(const std::string& folder, const std::function<bool(const std::string& name)>& ours,
                     const std::string& beginning)
{
  std::vector<fs::path> earlier;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
  {
    if (!fs::is_regular_file(entry.symlink_status()) || !ours(entry.path().filename().string()))
      continue;
    std::ifstream file(entry.path(), std::ios::binary);
    std::string start(beginning.size(), '\0');
    file.read(start.data(), static_cast<std::streamsize>(start.size()));
    start.resize(static_cast<std::size_t>(file.gcount()));
    if (!start.empty() && start != beginning)
    {
      throw std::runtime_error(entry.path().string() +
                               ": was not written by slender_sim, and would be mixed with what is written now; move it "
                               "away, or name another folder");
    }
    earlier.push_back(entry.path());
  }
  for (const fs::path& path : earlier)
    fs::remove(path);
}

}   // namespace slender
