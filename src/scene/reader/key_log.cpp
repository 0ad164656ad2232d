#include "key_log.h"

#include <algorithm>
#include <cctype>
#include <limits>

#include "yaml_tree.h"

namespace slender {

namespace {

std::string joined(const std::string& path, const std::string& part) { return path.empty() ? part : path + "." + part; }

std::string parentOf(const std::string& path)
{
  const auto dot = path.rfind('.');
  return dot == std::string::npos ? "" : path.substr(0, dot);
}

}   // namespace

bool isPlaceInList(const std::string& part)
{
  return !part.empty() && std::all_of(part.begin(), part.end(), [](unsigned char c) { return std::isdigit(c); });
}

std::string KeyLog::general(const std::string& path, bool& own) const
{
  own = true;
  std::string result;
  for (const std::string& part : path.empty() ? std::vector<std::string>() : split(path, '.'))
  {
    const auto owner = shared_.find(result);
    if (owner != shared_.end())
    {
      result = owner->second;
      own = false;
    }
    result = joined(result, named_.count(result) ? "NAME" : isPlaceInList(part) ? "N" : part);
  }
  return result;
}

KeyLog::Entry& KeyLog::entryOf(const std::string& path)
{
  bool own = true;
  const std::string key = general(path, own);
  const auto [place, is_new] = places_.emplace(key, entries_.size());
  if (is_new)
    entries_.push_back({{key, "", "", ""}, std::numeric_limits<long>::max(), false});
  Entry& entry = entries_[place->second];
  if (own && entry.order == std::numeric_limits<long>::max())
    entry.order = asked_++;
  return entry;
}

void KeyLog::noteNamed(const std::string& path)
{
  bool own = true;
  const std::string key = general(path, own);
  const auto owner = shared_.find(key);
  named_[owner == shared_.end() ? key : owner->second] = true;
}

void KeyLog::noteShared(const std::string& path, const std::string& owner)
{
  Entry& entry = entryOf(path);
  if (entry.key.path == owner)
    return;
  entry.key.keys_of = owner;
  shared_[entry.key.path] = owner;
}

void KeyLog::noteMeaning(const std::string& path, const std::string& meaning)
{
  std::string& known = entryOf(path).key.meaning;
  if (known.empty())
    known = meaning;
}

void KeyLog::noteValue(const std::string& path, const std::string& what)
{
  Entry& entry = entryOf(path);
  entry.key.what = what;
  entry.value_in_words = true;
}

void KeyLog::note(const std::string& path, const std::string& what)
{
  Entry& entry = entryOf(path);
  std::string& known = entry.key.what;
  if (entry.value_in_words || what.empty() ||
      ("; or " + known + "; or ").find("; or " + what + "; or ") != std::string::npos)
    return;
  known += (known.empty() ? "" : "; or ") + what;
}

std::vector<SceneKey> KeyLog::keys() const
{
  // Keys are ordered by their places and by those of all keys that contain them. Entries of lists have no place.
  std::map<std::vector<std::pair<long, std::size_t>>, const Entry*> sorted;
  for (const Entry& entry : entries_)
  {
    std::vector<std::pair<long, std::size_t>> place;
    for (std::string path = entry.key.path; !path.empty(); path = parentOf(path))
      if (const auto asked = places_.find(path); asked != places_.end())
        place.insert(place.begin(), {entries_[asked->second].order, asked->second});
    sorted[place] = &entry;
  }
  std::vector<SceneKey> result;
  for (const auto& [place, entry] : sorted)
  {
    const std::string& path = entry->key.path;
    if (path.empty() || joined(parentOf(path), "N") == path)
      continue;
    result.push_back(entry->key);
    const auto item = places_.find(path + ".N");
    std::string& what = result.back().what;
    if (item != places_.end() && what.empty() && !entries_[item->second].key.what.empty())
      what = "a list, each entry " + entries_[item->second].key.what;
  }
  return result;
}

}   // namespace slender
