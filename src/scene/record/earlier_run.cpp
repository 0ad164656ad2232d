#include "earlier_run.h"

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <vector>

namespace slender {

namespace fs = std::filesystem;

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
