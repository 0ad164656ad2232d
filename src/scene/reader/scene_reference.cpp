// The keys of scene files as a page for docs, and as text for the terminal.
#include "slender_sim/scene/scene_reference.h"

#include <algorithm>
#include <cctype>
#include <set>
#include <sstream>

#include "scene_text.h"
#include "yaml_cursor.h"

namespace slender {

namespace {

bool isBelow(const std::string& path, const std::string& section)
{
  return path.size() > section.size() && path.compare(0, section.size(), section) == 0 && path[section.size()] == '.';
}

/// Number of keys below a key.
std::ptrdiff_t keysBelow(const std::vector<SceneKey>& keys, const std::string& path)
{
  return std::count_if(keys.begin(), keys.end(), [&](const SceneKey& key) { return isBelow(key.path, path); });
}

/// What GitHub makes of a heading: "rods.N.material" becomes "rodsnmaterial".
std::string anchorOf(const std::string& heading)
{
  std::string anchor;
  for (const char c : heading)
    if (std::isalnum(static_cast<unsigned char>(c)) || c == '_')
      anchor += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return anchor;
}

std::string escaped(std::string text)
{
  for (std::size_t k = 0; (k = text.find('|', k)) != std::string::npos; k += 2)
    text.insert(k, "\\");
  return text;
}

/// Words joined to lines of at most 100 columns.
std::string wrapped(const std::string& text, const std::string& indent)
{
  constexpr std::size_t width = 100;
  std::istringstream words(text);
  std::string out, line = indent;
  for (std::string word; words >> word;)
  {
    if (line.size() > indent.size() && line.size() + 1 + word.size() > width)
    {
      out += line + "\n";
      line = indent;
    }
    line += (line.size() > indent.size() ? " " : "") + word;
  }
  return line.size() > indent.size() ? out + line + "\n" : out;
}

/// Sections of a part that get a heading of their own: those with so many keys that the part's table would be hard to
/// read.
class Page
{
public:
  explicit Page(const std::vector<SceneKey>& keys) : keys_(keys)
  {
    constexpr std::ptrdiff_t many = 8;
    for (const SceneKey& key : keys)
    {
      const std::size_t depth = split(key.path, '.').size();
      const bool in_list = key.path.find(".N.") != std::string::npos || key.path.find(".NAME.") != std::string::npos;
      if (depth > 1 && in_list && keysBelow(keys, key.path) >= many &&
          headingOf(key.path).find('.') == std::string::npos)
        headings_.push_back(key.path);
    }
  }

  std::string text() const
  {
    std::ostringstream out;
    for (const SceneKey& key : keys_)
      if (key.path.find('.') == std::string::npos)
      {
        out << "\n## " << key.path << "\n\n";
        writeSection(out, key);
        for (const std::string& heading : headings_)
          if (isBelow(heading, key.path))
          {
            out << "\n### " << heading << "\n\n";
            writeSection(
                out, *std::find_if(keys_.begin(), keys_.end(), [&](const SceneKey& k) { return k.path == heading; }));
          }
      }
    return out.str();
  }

private:
  /// The heading under which a key stands, or that it is below.
  std::string headingOf(const std::string& path) const
  {
    for (const std::string& heading : headings_)
      if (isBelow(path, heading))
        return heading;
    return path.substr(0, path.find('.'));
  }

  void writeSection(std::ostringstream& out, const SceneKey& section) const
  {
    const auto belongs = [&](const SceneKey& key) {
      return isBelow(key.path, section.path) && headingOf(key.path) == section.path;
    };
    const bool is_part = section.path.find('.') == std::string::npos;
    const bool has_rows = std::any_of(keys_.begin(), keys_.end(), belongs);
    if (is_part && has_rows)
      out << wrapped(section.meaning, "") << "\n";
    out << "| Key | Value | Meaning |\n|---|---|---|\n";
    if (is_part && (!has_rows || !section.what.empty()))
      writeRow(out, section, has_rows);
    for (const SceneKey& key : keys_)
      if (belongs(key))
        writeRow(out, key, false);
  }

  /// `meaning_above`: the meaning stands above the table.
  void writeRow(std::ostringstream& out, const SceneKey& key, bool meaning_above) const
  {
    const bool is_name = key.path.size() > 5 && key.path.compare(key.path.size() - 5, 5, ".NAME") == 0;
    std::string value = is_name && keysBelow(keys_, key.path) > 0 ? "" : key.what;
    const auto alsoMap = [&value](const std::string& text) { value += (value.empty() ? "" : "; or ") + text; };
    if (!key.keys_of.empty())
      alsoMap("a map, keys as of [`" + key.keys_of + "`](#" + anchorOf(sectionOf(key.keys_of)) + ")");
    else if (std::find(headings_.begin(), headings_.end(), key.path) != headings_.end() && !meaning_above)
      alsoMap(kindOf(key.path) + ", see [below](#" + anchorOf(key.path) + ")");
    else if (keysBelow(keys_, key.path) > 0)
      alsoMap(kindOf(key.path));
    out << "| `" << key.path << "` | " << escaped(value) << " | " << (meaning_above ? "See above." : meaningOf(key))
        << " |\n";
  }

  /// The meaning, or where it stands if an earlier key has the same one and it is long.
  std::string meaningOf(const SceneKey& key) const
  {
    constexpr std::size_t is_long = 80;   // about a line of text
    const auto same =
        std::find_if(keys_.begin(), keys_.end(), [&](const SceneKey& k) { return k.meaning == key.meaning; });
    return key.meaning.size() < is_long || same->path == key.path ? escaped(key.meaning) : "As `" + same->path + "`.";
  }

  /// What a key with keys below it takes.
  std::string kindOf(const std::string& path) const
  {
    const auto has = [&](const std::string& below) {
      return std::any_of(keys_.begin(), keys_.end(), [&](const SceneKey& key) {
        return key.path == path + below || isBelow(key.path, path + below);
      });
    };
    return has(".NAME") ? "a map of names" : has(".N") ? "a list of maps" : "a map";
  }

  std::string sectionOf(const std::string& path) const
  {
    return std::find(headings_.begin(), headings_.end(), path) != headings_.end() ? path : headingOf(path);
  }

  const std::vector<SceneKey>& keys_;
  std::vector<std::string> headings_;
};

/// Whether a part of a query stands for a part of a key's path: the same word, a place in a list, or a user's name.
bool fits(const std::string& part, const std::string& asked)
{
  return part == asked || part == "NAME" || (part == "N" && isPlaceInList(asked));
}

/// The path of the key that a query names, where it is described; empty: none.
std::string resolved(const std::vector<SceneKey>& keys, const std::string& query)
{
  std::set<std::string> at = {""};
  for (const std::string& asked : split(query, '.'))
  {
    std::set<std::string> next;
    for (const std::string& path : at)
    {
      const auto key = std::find_if(keys.begin(), keys.end(), [&](const SceneKey& k) { return k.path == path; });
      const std::string owner = key != keys.end() && !key->keys_of.empty() ? key->keys_of : path;
      for (const SceneKey& k : keys)
      {
        const std::size_t begin = owner.empty() ? 0 : owner.size() + 1;
        if (!owner.empty() && !isBelow(k.path, owner))
          continue;
        const auto dot = k.path.find('.', begin);
        const std::string part = k.path.substr(begin, dot == std::string::npos ? dot : dot - begin);
        if (fits(part, asked))
          next.insert(owner.empty() ? part : owner + "." + part);
      }
    }
    at = std::move(next);
    if (at.empty())
      return "";
  }
  // a key's own word counts more than a user's name
  const auto named = [](const std::string& path) { return path.find("NAME") != std::string::npos; };
  const auto plain = std::find_if_not(at.begin(), at.end(), named);
  return plain != at.end() ? *plain : *at.begin();
}

std::string described(const std::vector<SceneKey>& keys, const SceneKey& key)
{
  std::string text = key.path + "\n";
  std::string value = key.what;
  if (!key.keys_of.empty())
    value += (value.empty() ? "" : "; or ") + ("a map, keys as of " + key.keys_of);
  text += wrapped(value, "    ") + wrapped(key.meaning, "    ");
  std::string others;
  for (const SceneKey& other : keys)
    if (other.keys_of == key.path)
      others += (others.empty() ? "" : ", ") + other.path;
  return text + (others.empty() ? "" : wrapped("Same keys: " + others + ".", "    "));
}

}   // namespace

std::vector<SceneKey> sceneKeys()
{
  KeyLog log;
  for (const std::string& scene : everyKeyScenes())
    logKeysOf(scene, log);
  return log.keys();
}

std::vector<SceneKey> sceneKeys(const std::vector<std::string>& files)
{
  KeyLog log;
  for (const std::string& file : files)
    logKeys(file, log);
  return log.keys();
}

std::string sceneReference(const std::vector<SceneKey>& keys)
{
  const char* const how =
      "This page is written by the reader of scene files itself: `rosrun slender_sim scene_reference`. "
      "`scene_reference --key rods.N.grasps.NAME.attach` explains one key, and `--key attach` all keys of that name.";
  const char* const notation =
      "`N` is a place in a list, counted from 0. `NAME` is a name of yours. All units are SI units, and angles are in "
      "rad. [The scene file](scene_file.md) shows how a scene is written.";
  return "# Keys of scene files\n\n" + wrapped(how, "") + "\n" + wrapped(notation, "") + Page(keys).text();
}

std::string describeKeys(const std::vector<SceneKey>& keys, const std::string& query)
{
  std::string text;
  const std::string path = resolved(keys, query);
  for (const SceneKey& key : keys)
  {
    const std::vector<std::string> parts = split(key.path, '.');
    const bool named = path.empty() ? std::find(parts.begin(), parts.end(), query) != parts.end()
                                    : key.path == path || isBelow(key.path, path);
    // a word that is a section as well as a key elsewhere: both
    const bool elsewhere = query.find('.') == std::string::npos && parts.back() == query;
    if (named || elsewhere)
      text += (text.empty() ? "" : "\n") + described(keys, key);
  }
  return text;
}

std::string nearestKey(const std::vector<SceneKey>& keys, const std::string& query)
{
  std::vector<std::string> words;
  for (const SceneKey& key : keys)
    for (const std::string& part : split(key.path, '.'))
      if (part != "N" && part != "NAME")
        words.push_back(part);
  return nearestWord(query.substr(query.rfind('.') + 1), words);
}

}   // namespace slender
