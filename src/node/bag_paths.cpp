#include "slender_sim/node/bag_paths.h"

#include <filesystem>
#include <stdexcept>

#include "slender_sim/scene/file_paths.h"

namespace slender {

namespace fs = std::filesystem;

std::string previousBag(const std::string& path)
{
  const fs::path file(path);
  return (file.parent_path() / (file.stem().string() + ".previous" + file.extension().string())).string();
}

void requireOtherBag(const std::string& path, const std::string& read, const std::string& reader)
{
  const std::string target = replaceablePath(path);
  for (const std::string& written : {target, target + ".active", previousBag(target)})
  {
    std::error_code error;
    if (fs::equivalent(written, read, error) && !error)
    {
      throw std::runtime_error("bag " + path + ": would replace " + read + ", which " + reader +
                               " reads; name another file");
    }
  }
}

}   // namespace slender
