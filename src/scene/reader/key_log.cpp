#include "key_log.h"

#include <algorithm>
#include <cctype>
#include <functional>
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
  for (const std::string& part : path.empty() ? std::vector<std::string>() : splitPath(path))
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
  std::vector<const Entry*> entries;
  for (const Entry& entry : entries_)
    entries.push_back(&entry);
  std::stable_sort(entries.begin(), entries.end(), [](const Entry* a, const Entry* b) { return a->order < b->order; });
  std::map<std::string, std::vector<const Entry*>> children;
  std::map<std::string, bool> asked;
  for (const Entry* entry : entries)
    asked[entry->key.path] = true;
  for (const Entry* entry : entries)
  {
    // places of a list are not asked for themselves, only what they hold
    std::string parent = parentOf(entry->key.path);
    while (!parent.empty() && !asked.count(parent))
      parent = parentOf(parent);
    children[parent].push_back(entry);
  }
  std::vector<SceneKey> result;
  const std::function<void(const Entry&)> add = [&](const Entry& entry) {
    const std::vector<const Entry*>& below = children[entry.key.path];
    result.push_back(entry.key);
    SceneKey& key = result.back();
    const auto isEntryOfList = [&](const Entry* child) { return child->key.path == entry.key.path + ".N"; };
    const auto item = std::find_if(below.begin(), below.end(), isEntryOfList);
    if (item != below.end() && key.what.empty() && !(*item)->key.what.empty())
      key.what = "a list, each entry " + (*item)->key.what;
    for (const Entry* child : below)
    {
      if (!isEntryOfList(child))
        add(*child);
      else
        for (const Entry* part : children[child->key.path])
          if (part->key.path != child->key.path + ".N")
            add(*part);
    }
  };
  for (const Entry* entry : children[""])
    if (!entry->key.path.empty())
      add(*entry);
  return result;
}

}   // namespace slender
