#pragma once

#include <exception>
#include <initializer_list>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "key_log.h"
#include "slender_sim/dynamics/failure_place.h"
#include "yaml_tree.h"

namespace slender {

/// Returns the value of a text that is a decimal number as a whole (1, -2.5, 1e6, +3, also YAML's .inf and .nan),
/// whatever the locale. Returns nothing for other texts, and infinity if the number is too large.
std::optional<double> parseNumber(const std::string& text);

/// Allowed values of a number, written as mathematicians do: (0, 10] m.
struct Range
{
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool open_low = false;   ///< low itself is not allowed
  bool open_high = false;
  const char* unit = "";

  bool holds(double x) const { return (open_low ? x > low : x >= low) && (open_high ? x < high : x <= high); }
  std::string text() const;

  static Range closed(double low, double high, const char* unit = "") { return {low, high, false, false, unit}; }
  /// (low, high]
  static Range above(double low, double high, const char* unit = "") { return {low, high, true, false, unit}; }
  /// (low, high)
  static Range between(double low, double high, const char* unit = "") { return {low, high, true, true, unit}; }
};

/// Overwrites `target` when there is a value.
template <class Target, class Value>
void assign(Target& target, const std::optional<Value>& value)
{
  if (value)
    target = *value;
}

/// The words that a key takes, each with the value that it stands for.
template <class Value>
using Choices = std::vector<std::pair<std::string, Value>>;

/// Returns all values of an enumeration up to `last`, with the words of toString().
template <class Value>
Choices<Value> allUpTo(Value last)
{
  Choices<Value> choices;
  for (int k = 0; k <= static_cast<int>(last); ++k)
    choices.emplace_back(toString(static_cast<Value>(k)), static_cast<Value>(k));
  return choices;
}

/// Everything wrong with one scene, in the order found.
class Problems
{
public:
  /// `log`: gets every key that is asked for; may be null.
  explicit Problems(std::string file, KeyLog* log = nullptr) : file_(std::move(file)), log_(log) {}

  void add(const std::string& line) { lines_.push_back(line); }
  /// Adds a warning, once. Warnings do not make the scene unusable: empty() does not count them.
  void warn(const std::string& line);
  const std::vector<std::string>& warnings() const { return warnings_; }
  const std::string& file() const { return file_; }

  bool empty() const { return lines_.empty(); }
  std::size_t size() const { return lines_.size(); }
  std::string text() const;
  KeyLog* log() const { return log_; }

private:
  std::string file_;
  KeyLog* log_;
  std::vector<std::string> lines_, warnings_;
};

/// One value of a scene with its path: typed, checked access. Every getter returns nothing when the value is absent or
/// wrong, and reports it in the second case, so that reading goes on and finds the other problems too.
class YamlCursor
{
public:
  /// `meaning`: a sentence that says what the key does, or nullptr. It must live as long as the program.
  YamlCursor(const YamlTree* tree, const YamlTree* parent, std::string path, Problems& problems,
             const char* meaning = nullptr)
    : tree_(tree),
      parent_(parent),
      path_(std::move(path)),
      problems_(&problems),
      meaning_(meaning)
  {
  }

  bool present() const { return tree_ != nullptr; }
  bool isScalar() const { return tree_ && tree_->kind == YamlTree::Kind::scalar; }
  bool isList() const { return tree_ && tree_->kind == YamlTree::Kind::list; }
  bool isMap() const { return tree_ && tree_->kind == YamlTree::Kind::map; }
  bool isWord(const char* word) const { return isScalar() && tree_->scalar == word; }
  const YamlTree* tree() const { return tree_; }
  const std::string& path() const { return path_; }
  Problems& problems() const { return *problems_; }

  /// "FILE:LINE: PATH" (or the override in place of file and line), for messages of those who take the value over.
  std::string place() const;
  /// Reports "FILE:LINE: PATH = VALUE: reason": what is wrong with this value. Returns nothing, as a reader does that
  /// reports.
  std::nullopt_t problem(const std::string& reason) const
  {
    problems_->add(line(reason));
    return std::nullopt;
  }
  /// Calls an action. Reports what it throws, and returns false then.
  template <class Action>
  bool attempt(const Action& action) const
  {
    try
    {
      action();
      return true;
    }
    catch (const std::exception& error)
    {
      problem(error.what());
      return false;
    }
  }
  /// Warns of this value: the scene runs, but not as its writer may expect. The text says what happens instead and what
  /// to do.
  void warning(const std::string& text) const { problems_->warn(line(text)); }

  /// Says in the reference of scene files that the keys below this one are those below the key `owner`, for example
  /// "rods.N.material". The reference describes them there alone.
  const YamlCursor& sharesKeysOf(const char* owner) const
  {
    if (KeyLog* log = problems_->log())
      log->noteShared(path_, owner);
    return *this;
  }
  /// Says in the reference of scene files which values this key takes, where the typed getters below would say it less
  /// well: for tables, for lists of lists, and for bounds that depend on other keys.
  const YamlCursor& takes(const char* values) const
  {
    if (KeyLog* log = problems_->log())
      log->noteValue(path_, values);
    return *this;
  }

  /// The value of a key of this map, which has been read elsewhere with its meaning.
  YamlCursor find(const std::string& key) const;

  std::optional<double> number(const Range& range) const;
  std::optional<int> integer(long low, long high, const char* unit = "") const;
  std::optional<bool> boolean() const;
  std::optional<std::string> text() const;
  /// A word of letters, digits and '_' that starts with a letter (names become topic names).
  std::optional<std::string> name() const;
  /// Reports the entry of a map unless `name`, under which it stands, is a name.
  void checkOwnName(const std::string& name) const;
  /// `range` holds for each component.
  std::optional<Eigen::Vector3d> vector3(const Range& range) const;
  /// A list of numbers, or a single number as a list of one.
  std::optional<std::vector<double>> numbers(const Range& range) const;

  template <class Value>
  std::optional<Value> choice(const Choices<Value>& choices) const
  {
    std::vector<std::string> words;
    for (const auto& entry : choices)
      words.push_back(entry.first);
    const int found = chosen(words);
    return found < 0 ? std::nullopt : std::optional<Value>(choices[found].second);
  }

  /// Each of these reads the value into `target`, which stays as it is when the value is absent or wrong.
  void read(double& target, const Range& range) const { assign(target, number(range)); }
  void read(std::optional<double>& target, const Range& range) const { assign(target, number(range)); }
  void read(int& target, const Range& closed) const
  {
    assign(target, integer(static_cast<long>(closed.low), static_cast<long>(closed.high), closed.unit));
  }
  void read(Eigen::Vector3d& target, const Range& range) const { assign(target, vector3(range)); }
  void read(bool& target) const { assign(target, boolean()); }
  void read(std::string& target) const { assign(target, text()); }
  template <class Value>
  void read(Value& target, const Choices<Value>& choices) const
  {
    assign(target, choice(choices));
  }

  /// Entries of a list; reports and returns none for anything else. `size`: allowed sizes.
  std::vector<YamlCursor> items(std::size_t min_size = 0,
                                std::size_t max_size = std::numeric_limits<std::size_t>::max()) const;
  /// Members of a map whose keys are names that the user gives, in file order; reports and returns none for anything
  /// else. `meaning`: a sentence that says what each of them is.
  std::vector<std::pair<std::string, YamlCursor>> members(const char* meaning) const;

private:
  std::string line(const std::string& text) const;
  std::optional<double> numberIn(const Range& range, const std::string& expected) const;
  std::optional<std::vector<double>> numbersIn(const Range& range) const;   ///< of a list
  std::optional<std::string> word() const;
  bool check(YamlTree::Kind kind, const char* expected) const;
  /// Notes in the log that the key is asked for, and the values that it may have.
  void asked(const std::string& what) const
  {
    if (KeyLog* log = problems_->log())
      log->note(path_, what);
  }
  int chosen(const std::vector<std::string>& words) const;
  std::string shortMeaning() const;
  std::string below(const std::string& key) const { return path_ + (path_.empty() ? "" : ".") + key; }

  friend class YamlMap;

  const YamlTree* tree_;
  const YamlTree* parent_;
  std::string path_;
  Problems* problems_;
  const char* meaning_;
};

/// A map whose keys are asked for by name, each with its meaning: a sentence that says what the key does and what holds
/// without it. The meanings are the text of docs/scene_reference.md. Keys nobody asked for are reported, with the
/// nearest known one, where the map goes out of scope, or before by finish().
class YamlMap
{
public:
  explicit YamlMap(const YamlCursor& at);
  YamlMap(const YamlMap&) = delete;
  ~YamlMap() { finish(); }

  YamlCursor get(const std::string& key, const char* meaning);
  /// Like get(), but reports a key that is missing.
  YamlCursor require(const std::string& key, const char* meaning);
  /// These also read the value into `target`, which stays as it is when the value is absent or wrong. `allowed` is what
  /// YamlCursor::read() takes for such a target: a range, or words with their values.
  template <class Target>
  YamlCursor get(const std::string& key, Target& target, const Range& allowed, const char* meaning)
  {
    return read(get(key, meaning), target, allowed);
  }
  template <class Target>
  YamlCursor get(const std::string& key, Target& target, const Choices<Target>& allowed, const char* meaning)
  {
    return read(get(key, meaning), target, allowed);
  }
  template <class Target>
  YamlCursor get(const std::string& key, Target& target, const char* meaning)
  {
    return read(get(key, meaning), target);
  }
  template <class Target>
  YamlCursor require(const std::string& key, Target& target, const Range& allowed, const char* meaning)
  {
    return read(require(key, meaning), target, allowed);
  }
  YamlCursor require(const std::string& key, std::string& target, const char* meaning)
  {
    return read(require(key, meaning), target);
  }
  /// The key `name`, whose value must be a name.
  void getName(std::string& target, const char* meaning) { assign(target, get("name", meaning).name()); }
  /// A key that has been read elsewhere with its meaning, for checks that concern several keys.
  YamlCursor find(const std::string& key) const;
  /// Reports that a key is missing that only some of the other values need. The key has been read with its meaning.
  void missing(const std::string& key) const;
  bool has(const std::string& key) const { return map_ && map_->find(key); }
  const YamlCursor& at() const { return at_; }
  /// Whether nothing was reported since this map was begun.
  bool sound() const { return at_.problems().size() == before_; }
  /// Whether exactly one of these keys is given. Reports `otherwise` of the map if not, unless finish() has found an
  /// unknown key, which may stand for one of them.
  bool hasOne(std::initializer_list<YamlCursor> keys, const std::string& otherwise) const;
  /// Reports unknown keys now, for checks that come after it. A map that was not asked for any key has none.
  void finish();

private:
  YamlCursor childOf(const std::string& key, const char* meaning) const;
  template <class Target, class... Allowed>
  static YamlCursor read(const YamlCursor& at, Target& target, const Allowed&... allowed)
  {
    at.read(target, allowed...);
    return at;
  }

  YamlCursor at_;
  std::size_t before_;   ///< number of problems when the map was begun
  const YamlTree* map_ = nullptr;
  std::vector<std::string> known_;   ///< until finish()
  bool has_unknown_ = false;
};

/// The word most like `word` (few edits), or empty.
std::string nearestWord(const std::string& word, const std::vector<std::string>& words);
/// " (did you mean WORD?)" with the nearest word, or empty.
std::string didYouMean(const std::string& word, const std::vector<std::string>& words);
/// The first words with commas between them, at most so many.
std::string joinWords(const std::vector<std::string>& words,
                      std::size_t most = std::numeric_limits<std::size_t>::max());
/// "; it has: a, b", for messages about a name that is not among these; at most ten of them.
std::string itHas(const std::vector<std::string>& names);
/// The text without blanks at its ends.
std::string trimmed(const std::string& text);

}   // namespace slender
