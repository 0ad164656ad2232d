#include "key_log.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <sstream>

#include "reader_log.h"
#include "slender_sim/scene/reader.h"

namespace slender {

std::string KeyLog::general(const std::string& path) const
{
  std::string result;
  std::istringstream parts(path);
  for (std::string part; std::getline(parts, part, '.');)
  {
    if (named_.count(result))
      part = "NAME";
    else if (!part.empty() && std::all_of(part.begin(), part.end(), [](unsigned char c) { return std::isdigit(c); }))
      part = "N";
    result += (result.empty() ? "" : ".") + part;
  }
  return result;
}

void KeyLog::noteNamed(const std::string& path) { named_[general(path)] = true; }

void KeyLog::note(const std::string& path, const std::string& what)
{
  const std::string key = general(path);
  const auto [place, is_new] = places_.emplace(key, keys_.size());
  if (is_new)
  {
    keys_.push_back({key, what});
    return;
  }
  std::string& known = keys_[place->second].what;
  if (what.empty() || ("; or " + known + "; or ").find("; or " + what + "; or ") != std::string::npos)
    return;
  known += (known.empty() ? "" : "; or ") + what;
}

std::vector<SceneKey> KeyLog::keys() const
{
  // places of a list of numbers say nothing that the list does not
  std::vector<SceneKey> result;
  for (const SceneKey& key : keys_)
  {
    const std::string end = key.path.size() > 2 ? key.path.substr(key.path.size() - 2) : "";
    const auto list = end == ".N" ? places_.find(key.path.substr(0, key.path.size() - 2)) : places_.end();
    if (list == places_.end() || keys_[list->second].what.empty())
      result.push_back(key);
  }
  return result;
}

std::vector<SceneKey> sceneKeys(const std::vector<std::string>& files)
{
  KeyLog log;
  for (const std::string& file : files)
  {
    try
    {
      logKeys(file, log);
    }
    catch (const SceneError&)
    {
      if (!std::filesystem::is_regular_file(file))
        throw;
    }
  }
  return log.keys();
}

std::string sceneReference(const std::vector<SceneKey>& keys)
{
  // an object of the scene after the other, each with all its keys
  std::vector<std::string> parts;
  const auto partOf = [](const SceneKey& key) { return key.path.substr(0, key.path.find('.')); };
  for (const SceneKey& key : keys)
    if (std::find(parts.begin(), parts.end(), partOf(key)) == parts.end())
      parts.push_back(partOf(key));
  std::ostringstream out;
  out << "# Keys of scene files\n\nWritten by `scene_reference config/scenes/*.yaml test/scenes/every_key.yaml` from "
         "what the reader asks for; N: a place in a list, NAME: a name of yours.\n";
  for (const std::string& part : parts)
  {
    out << "\n## " << part << "\n\n| Key | Value |\n|---|---|\n";
    for (const SceneKey& key : keys)
      if (partOf(key) == part && !key.what.empty())
      {
        std::string what = key.what;
        for (std::size_t k = 0; (k = what.find('|', k)) != std::string::npos; k += 2)
          what.insert(k, "\\");
        out << "| `" << key.path << "` | " << what << " |\n";
      }
  }
  return out.str();
}

}   // namespace slender
