#include "yaml_cursor.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <numeric>

namespace slender {

namespace {

constexpr std::size_t max_reported = 50;
constexpr std::size_t max_name = 64;

std::size_t editDistance(const std::string& a, const std::string& b)
{
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i)
  {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j)
    {
      const std::size_t change = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, change});
    }
  }
  return row[b.size()];
}

/// The value as the user wrote it, cut to a line's length.
std::string quote(const YamlTree& tree)
{
  std::string text;
  switch (tree.kind)
  {
    case YamlTree::Kind::null: return "";
    case YamlTree::Kind::scalar: text = tree.scalar; break;
    case YamlTree::Kind::map: return "";
    case YamlTree::Kind::list:
      text = "[";
      for (const YamlTree& item : tree.items)
      {
        text += (text.size() > 1 ? ", " : "") + (item.kind == YamlTree::Kind::map ? std::string("{...}") : quote(item));
        if (text.size() > 60)
          break;
      }
      text += "]";
  }
  for (char& c : text)
    c = std::iscntrl(static_cast<unsigned char>(c)) ? ' ' : c;
  return text.size() > 60 ? text.substr(0, 57) + "..." : text;
}

}   // namespace

std::optional<double> parseNumber(const std::string& text)
{
  std::string plain = text;
  if (plain.size() > 1 && plain[0] == '+')
  {
    plain.erase(0, 1);
    if (plain[0] == '-' || plain[0] == '+')
      return std::nullopt;
  }
  const bool minus = !plain.empty() && plain[0] == '-';
  const std::string magnitude = plain.substr(minus ? 1 : 0);
  if (magnitude == ".inf" || magnitude == ".Inf" || magnitude == ".INF")
    return minus ? -std::numeric_limits<double>::infinity() : std::numeric_limits<double>::infinity();
  if (plain == ".nan" || plain == ".NaN" || plain == ".NAN")
    return std::numeric_limits<double>::quiet_NaN();
  double value = 0.0;
  const char* end = plain.data() + plain.size();
  const auto result = std::from_chars(plain.data(), end, value);
  if (result.ptr != end || plain.empty())
    return std::nullopt;
  if (result.ec == std::errc::result_out_of_range)
  {
    const bool tiny = magnitude.find("e-") != std::string::npos || magnitude.find("E-") != std::string::npos;
    return tiny ? 0.0 : (minus ? -1.0 : 1.0) * std::numeric_limits<double>::infinity();
  }
  return result.ec == std::errc() ? std::optional<double>(value) : std::nullopt;
}

std::string joinWords(const std::vector<std::string>& words, std::size_t most)
{
  std::string text;
  for (std::size_t k = 0; k < std::min(words.size(), most); ++k)
    text += (text.empty() ? "" : ", ") + words[k];
  return text;
}

std::string itHas(const std::vector<std::string>& names)
{
  return names.empty() ? ", which has none" : "; it has: " + joinWords(names, 10);
}

std::string trimmed(const std::string& text)
{
  const char* const blank = " \t\r\n";
  const auto first = text.find_first_not_of(blank);
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(blank) - first + 1);
}

std::string nearestWord(const std::string& word, const std::vector<std::string>& words)
{
  std::string best;
  std::size_t best_distance = std::max<std::size_t>(2, word.size() / 3) + 1;
  for (const std::string& candidate : words)
  {
    const std::size_t distance = editDistance(word, candidate);
    const bool contains = word.size() >= 4 && candidate.find(word) != std::string::npos;
    if (distance < best_distance || (contains && best.empty()))
    {
      best = candidate;
      best_distance = std::min(best_distance, distance);
    }
  }
  return best;
}

std::string didYouMean(const std::string& word, const std::vector<std::string>& words)
{
  const std::string nearest = nearestWord(word, words);
  return nearest.empty() ? "" : " (did you mean " + nearest + "?)";
}

std::string Range::text() const
{
  const std::string unit_text = *unit ? std::string(" ") + unit : "";
  if (std::isinf(low) && std::isinf(high))
    return "a finite number" + (*unit ? " [" + std::string(unit) + "]" : "");
  return std::string("in ") + (open_low ? "(" : "[") + shortNumber(low) + ", " + shortNumber(high) +
         (open_high ? ")" : "]") + unit_text;
}

void Problems::warn(const std::string& line)
{
  if (warnings_.size() < max_reported && std::find(warnings_.begin(), warnings_.end(), line) == warnings_.end())
    warnings_.push_back(line);
}

std::string Problems::text() const
{
  std::string text;
  for (std::size_t k = 0; k < std::min(lines_.size(), max_reported); ++k)
    text += (k ? "\n" : "") + lines_[k];
  if (lines_.size() > max_reported)
    text += "\n" + file_ + ": and " + std::to_string(lines_.size() - max_reported) + " more problems";
  return text;
}

std::string YamlCursor::place() const
{
  const YamlTree* place = tree_ ? tree_ : parent_;
  std::string line = problems_->file();
  if (place && !place->origin.empty())
    line = place->origin;
  else if (place && place->line > 0)
    line += ":" + std::to_string(place->line);
  return line + ": " + (path_.empty() ? "scene" : path_);
}

std::string YamlCursor::line(const std::string& text) const
{
  const std::string value = tree_ ? quote(*tree_) : "";
  return place() + (value.empty() ? "" : " = " + value) + ": " + text;
}

bool YamlCursor::check(YamlTree::Kind kind, const char* expected) const
{
  if (!tree_)
    return false;
  if (tree_->kind != kind)
  {
    problem(std::string("is ") + toString(tree_->kind) + "; must be " + expected);
    return false;
  }
  return true;
}

std::optional<double> YamlCursor::number(const Range& range) const
{
  asked("a number " + range.text());
  return numberIn(range, "a number " + range.text());
}

std::optional<double> YamlCursor::numberIn(const Range& range, const std::string& expected) const
{
  if (!check(YamlTree::Kind::scalar, expected.c_str()))
    return std::nullopt;
  const auto value = parseNumber(tree_->scalar);
  if (!value)
    return problem("is not a number; must be " + expected);
  if (!std::isfinite(*value))
    return problem("is not finite; must be " + expected);
  if (!range.holds(*value))
    return problem("is out of range; must be " + expected);
  return value;
}

std::optional<int> YamlCursor::integer(long low, long high, const char* unit) const
{
  const Range range = Range::closed(static_cast<double>(low), static_cast<double>(high), unit);
  const bool index = low == -high - 1;
  const std::string expected =
      "a whole number " + range.text() + (index ? ", an index from 0 or, if it is negative, from the end" : "");
  asked(index ? "an index from 0 or, if it is negative, from the end" : expected);
  const auto value = numberIn(range, expected);
  if (value && *value != std::floor(*value))
    return problem("must be " + expected);
  return value ? std::optional<int>(static_cast<int>(*value)) : std::nullopt;
}

std::optional<bool> YamlCursor::boolean() const
{
  asked("true or false");
  if (!check(YamlTree::Kind::scalar, "true or false"))
    return std::nullopt;
  std::string word = tree_->scalar;
  std::transform(word.begin(), word.end(), word.begin(), [](unsigned char c) { return std::tolower(c); });
  if (word == "true" || word == "yes" || word == "on")
    return true;
  if (word == "false" || word == "no" || word == "off")
    return false;
  return problem("must be true or false");
}

std::optional<std::string> YamlCursor::text() const
{
  asked("a text");
  return word();
}

std::optional<std::string> YamlCursor::word() const
{
  if (!check(YamlTree::Kind::scalar, "a text"))
    return std::nullopt;
  if (tree_->scalar.empty())
    return problem("is empty; must be a text");
  return tree_->scalar;
}

namespace {

std::string whyNoName(const std::string& name)
{
  const bool fits =
      !name.empty() && name.size() <= max_name && std::isalpha(static_cast<unsigned char>(name.front())) &&
      std::all_of(name.begin(), name.end(), [](unsigned char c) { return c < 128 && (std::isalnum(c) || c == '_'); });
  return fits ? ""
              : "is not a name; must be a letter and then letters, digits or '_', at most " + std::to_string(max_name);
}

}   // namespace

std::optional<std::string> YamlCursor::name() const
{
  asked("a name");
  auto name = word();
  if (const std::string why = name ? whyNoName(*name) : ""; !why.empty())
    return problem(why);
  return name;
}

void YamlCursor::checkOwnName(const std::string& name) const
{
  if (const std::string why = whyNoName(name); !why.empty())
    problem("is under the name \"" + name + "\", which " + why);
}

std::optional<Eigen::Vector3d> YamlCursor::vector3(const Range& range) const
{
  const std::string expected = "a list [x, y, z] of numbers " + range.text();
  asked(expected);
  if (!check(YamlTree::Kind::list, expected.c_str()))
    return std::nullopt;
  if (tree_->items.size() != 3)
    return problem("has " + std::to_string(tree_->items.size()) + " entries; must be " + expected);
  const auto values = numbersIn(range);
  return values ? std::optional<Eigen::Vector3d>(Eigen::Map<const Eigen::Vector3d>(values->data())) : std::nullopt;
}

std::optional<std::vector<double>> YamlCursor::numbers(const Range& range) const
{
  asked("a number or a list of numbers " + range.text());
  if (!tree_)
    return std::nullopt;
  if (isList())
    return numbersIn(range);
  const auto value = numberIn(range, "a number " + range.text());
  return value ? std::make_optional(std::vector<double>{*value}) : std::nullopt;
}

std::optional<std::vector<double>> YamlCursor::numbersIn(const Range& range) const
{
  std::vector<double> values;
  for (const YamlCursor& item : items())
    if (const auto value = item.numberIn(range, "a number " + range.text()))
      values.push_back(*value);
  return values.size() == tree_->items.size() ? std::optional<std::vector<double>>(std::move(values)) : std::nullopt;
}

int YamlCursor::chosen(const std::vector<std::string>& words) const
{
  const std::string expected = "one of: " + joinWords(words);
  asked(expected);
  if (!check(YamlTree::Kind::scalar, expected.c_str()))
    return -1;
  const auto found = std::find(words.begin(), words.end(), tree_->scalar);
  if (found == words.end())
  {
    problem("is not known; must be " + expected + didYouMean(tree_->scalar, words) + shortMeaning());
    return -1;
  }
  return static_cast<int>(found - words.begin());
}

std::vector<YamlCursor> YamlCursor::items(std::size_t min_size, std::size_t max_size) const
{
  std::vector<YamlCursor> entries;
  asked("");
  if (!check(YamlTree::Kind::list, "a list"))
    return entries;
  const std::size_t size = tree_->items.size();
  if (size < min_size || size > max_size)
  {
    std::string allowed = min_size == max_size ? std::to_string(min_size) : "at least " + std::to_string(min_size);
    if (min_size != max_size && max_size != std::numeric_limits<std::size_t>::max())
      allowed = std::to_string(min_size) + " to " + std::to_string(max_size);
    problem("has " + std::to_string(size) + " entries; must have " + allowed);
    return entries;
  }
  entries.reserve(size);
  for (std::size_t k = 0; k < size; ++k)
    entries.emplace_back(&tree_->items[k], tree_, below(std::to_string(k)), *problems_);
  return entries;
}

std::string YamlCursor::shortMeaning() const
{
  constexpr std::size_t longest = 120;   // one line of a terminal, beside the place and the allowed values
  if (!meaning_)
    return "";
  const std::string text = meaning_;
  const std::string first = text.substr(0, text.find(". "));
  const std::string sentence = !first.empty() && first.back() == '.' ? first.substr(0, first.size() - 1) : first;
  return sentence.size() > longest ? "" : "; " + path_.substr(path_.rfind('.') + 1) + ": " + sentence;
}

std::vector<std::pair<std::string, YamlCursor>> YamlCursor::members(const char* meaning) const
{
  std::vector<std::pair<std::string, YamlCursor>> entries;
  if (KeyLog* log = problems_->log())
  {
    log->noteNamed(path_);
    log->noteMeaning(below("NAME"), meaning);
  }
  if (!check(YamlTree::Kind::map, "a map of names"))
    return entries;
  for (const auto& [key, value] : tree_->members)
    entries.emplace_back(key, YamlCursor(&value, tree_, below(key), *problems_));
  return entries;
}

YamlCursor YamlCursor::find(const std::string& key) const { return YamlMap(*this).find(key); }

YamlMap::YamlMap(const YamlCursor& at) : at_(at), before_(at.problems().size())
{
  if (at.isMap())
    map_ = at.tree();
  else if (at.present())
    at.problem(std::string("is ") + toString(at.tree()->kind) + "; must be a map of keys and values");
}

YamlCursor YamlMap::childOf(const std::string& key, const char* meaning) const
{
  const YamlTree* value = map_ ? map_->find(key) : nullptr;
  return YamlCursor(value, at_.tree(), at_.below(key), at_.problems(), meaning);
}

YamlCursor YamlMap::get(const std::string& key, const char* meaning)
{
  const YamlCursor child = childOf(key, meaning);
  if (KeyLog* log = at_.problems().log())
    log->noteMeaning(child.path(), meaning);
  known_.push_back(key);
  return child;
}

YamlCursor YamlMap::require(const std::string& key, const char* meaning)
{
  const YamlCursor value = get(key, meaning);
  if (!value.present() && map_)
    value.problem("is missing" + value.shortMeaning());
  return value;
}

YamlCursor YamlMap::find(const std::string& key) const { return childOf(key, nullptr); }

void YamlMap::missing(const std::string& key) const { find(key).problem("is missing"); }

bool YamlMap::hasOne(std::initializer_list<YamlCursor> keys, const std::string& otherwise) const
{
  const bool one = std::count_if(keys.begin(), keys.end(), [](const YamlCursor& key) { return key.present(); }) == 1;
  if (!one && map_ && !has_unknown_)
    at_.problem(otherwise);
  return one;
}

void YamlMap::finish()
{
  if (!map_ || known_.empty())
    return;
  for (const auto& [key, value] : map_->members)
  {
    if (std::find(known_.begin(), known_.end(), key) != known_.end())
      continue;
    find(key).problem("unknown key" + didYouMean(key, known_) + "; known here: " + joinWords(known_));
    has_unknown_ = true;
  }
  known_.clear();
}

}   // namespace slender
