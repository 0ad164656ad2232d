#pragma once

#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "key_log.h"
#include "yaml_tree.h"

namespace slender {

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

/// Everything wrong with one scene, in the order found.
class Problems
{
public:
  /// `log`: gets every key that is asked for; may be null.
  explicit Problems(std::string file, KeyLog* log = nullptr) : file_(std::move(file)), log_(log) {}

  /// Adds "FILE:LINE: PATH = VALUE: reason" (or the override in place of file and line). `tree` may be null: then
  /// `parent` tells the line.
  void add(const YamlTree* tree, const YamlTree* parent, const std::string& path, const std::string& reason);
  /// "FILE:LINE: PATH".
  std::string placeOf(const YamlTree* tree, const YamlTree* parent, const std::string& path) const;
  void addText(const std::string& line) { lines_.push_back(line); }
  /// Adds the warning "FILE:LINE: PATH = VALUE: text", once. Warnings do not make the scene unusable: empty() does not
  /// count them.
  void warn(const YamlTree* tree, const YamlTree* parent, const std::string& path, const std::string& text);
  const std::vector<std::string>& warnings() const { return warnings_; }

  bool empty() const { return lines_.empty(); }
  std::size_t size() const { return lines_.size(); }
  std::string text() const;
  /// Notes a key that is asked for, and the values that it may have.
  void asked(const std::string& path, const std::string& what) const
  {
    if (log_)
      log_->note(path, what);
  }
  /// Notes what a key means.
  void means(const std::string& path, const char* meaning) const
  {
    if (log_)
      log_->noteMeaning(path, meaning);
  }
  /// Notes the values that a key may have, in words that replace those of the typed getters.
  void takes(const std::string& path, const char* what) const
  {
    if (log_)
      log_->noteValue(path, what);
  }
  /// Notes that the keys below a path are those below the key `owner`.
  void sharesKeys(const std::string& path, const char* owner) const
  {
    if (log_)
      log_->noteShared(path, owner);
  }
  /// What is below has names that the user gives.
  void named(const std::string& path) const
  {
    if (log_)
      log_->noteNamed(path);
  }

private:
  std::string file_;
  KeyLog* log_;
  std::string lineOf(const YamlTree* tree, const YamlTree* parent, const std::string& path,
                     const std::string& reason) const;

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
  const YamlTree* tree() const { return tree_; }
  const std::string& path() const { return path_; }
  Problems& problems() const { return *problems_; }

  /// "FILE:LINE: PATH", for messages of those who take the value over.
  std::string place() const { return problems_->placeOf(tree_, parent_, path_); }
  /// Reports what is wrong with this value.
  void problem(const std::string& reason) const { problems_->add(tree_, parent_, path_, reason); }
  /// Warns of this value: the scene runs, but not as its writer may expect. The text says what happens instead and what
  /// to do.
  void warning(const std::string& text) const { problems_->warn(tree_, parent_, path_, text); }

  /// Says in the reference of scene files that the keys below this one are those below the key `owner`, for example
  /// "rods.N.material". The reference describes them there alone.
  const YamlCursor& sharesKeysOf(const char* owner) const
  {
    problems_->sharesKeys(path_, owner);
    return *this;
  }
  /// Says in the reference of scene files which values this key takes, where the typed getters below would say it less
  /// well: for tables, for lists of lists, and for bounds that depend on other keys.
  const YamlCursor& takes(const char* values) const
  {
    problems_->takes(path_, values);
    return *this;
  }

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
  std::optional<Value> choice(const std::vector<std::pair<std::string, Value>>& choices) const
  {
    std::vector<std::string> words;
    for (const auto& entry : choices)
      words.push_back(entry.first);
    const int found = chosen(words);
    return found < 0 ? std::nullopt : std::optional<Value>(choices[found].second);
  }

  /// Entries of a list; reports and returns none for anything else. `size`: allowed sizes.
  std::vector<YamlCursor> items(std::size_t min_size = 0,
                                std::size_t max_size = std::numeric_limits<std::size_t>::max()) const;
  /// Members of a map whose keys are names that the user gives, in file order; reports and returns none for anything
  /// else. `meaning`: a sentence that says what each of them is.
  std::vector<std::pair<std::string, YamlCursor>> members(const char* meaning) const;

private:
  std::optional<double> numberIn(const Range& range, const std::string& expected) const;
  std::optional<std::string> word() const;
  bool check(YamlTree::Kind kind, const char* expected) const;
  int chosen(const std::vector<std::string>& words) const;
  std::string shortMeaning() const;

  friend class YamlMap;

  const YamlTree* tree_;
  const YamlTree* parent_;
  std::string path_;
  Problems* problems_;
  const char* meaning_;
};

/// A map whose keys are asked for by name, each with its meaning: a sentence that says what the key does and what holds
/// without it. The meanings are the text of docs/scene_reference.md. Keys nobody asked for are reported by finish(),
/// with the nearest known one.
class YamlMap
{
public:
  explicit YamlMap(const YamlCursor& at);

  YamlCursor get(const std::string& key, const char* meaning);
  /// Like get(), but reports a key that is missing.
  YamlCursor require(const std::string& key, const char* meaning);
  /// A key that has been read elsewhere with its meaning, for checks that concern several keys.
  YamlCursor find(const std::string& key) const;
  /// Reports that a key is missing that only some of the other values need. The key has been read with its meaning.
  void missing(const std::string& key) const;
  bool has(const std::string& key) const { return map_ && map_->find(key); }
  const YamlCursor& at() const { return at_; }
  void finish();

private:
  YamlCursor childOf(const std::string& key, const char* meaning) const;

  YamlCursor at_;
  const YamlTree* map_ = nullptr;
  std::vector<std::string> known_;
};

/// Overwrites `target` when there is a value.
template <class Target, class Value>
void assign(Target& target, const std::optional<Value>& value)
{
  if (value)
    target = *value;
}

/// "1.5e-3" rather than "0.001500".
std::string shortNumber(double value);

/// The word most like `word` (few edits), or empty.
std::string nearestWord(const std::string& word, const std::vector<std::string>& words);
std::string joinWords(const std::vector<std::string>& words);

}   // namespace slender
