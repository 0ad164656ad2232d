#pragma once

#include <chrono>
#include <deque>
#include <functional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <Eigen/Core>

#include "slender_sim/geometry/triangle_mesh.h"

namespace slender::study {

/// One row of a study's table: keys in the order in which they were set, each a number or a word.
class Row
{
public:
  using Value = std::variant<double, std::string>;

  Row& set(const std::string& key, double value);
  Row& set(const std::string& key, const std::string& value);
  Row& set(const std::string& key, const char* value) { return set(key, std::string(value)); }

  /// Marks the row as a check: |measured - expected| <= bound (bound > 0, same unit), `source` says where it comes
  /// from.
  Row& check(double measured, double expected, double bound, const std::string& source);

  const Value* find(const std::string& key) const;
  const std::vector<std::pair<std::string, Value>>& entries() const { return entries_; }

private:
  std::vector<std::pair<std::string, Value>> entries_;
};

struct Series
{
  std::string label;
  std::vector<double> x, y;
  bool points = false;   ///< no line, whatever the plot says
  bool line = false;     ///< a line without markers, whatever the plot says
};

/// A plot with units in its axis labels; series in order of the legend. Logarithmic axes unless told otherwise.
struct Plot
{
  std::string name;   ///< file name without ending
  std::string title;
  std::string x_label, y_label;
  bool log_x = true, log_y = true;
  bool lines = true;         ///< false: points only
  bool markers = true;       ///< false: lines only
  bool equal_axes = false;   ///< pictures of shapes
  std::deque<Series> series;

  /// The series with this label, added at its first use.
  Series& at(const std::string& label);
};

/// Shaded surfaces in panels beside each other, all seen along the same direction and at the same scale.
struct SurfacePicture
{
  static constexpr int kHues = 7;
  struct Surface
  {
    TriangleMesh mesh;
    bool cloth = true;        ///< else something that stands behind: grey
    Eigen::VectorXi hues{};   ///< of each face, 0 ... kHues - 1; empty: all of cloth's colour
  };
  struct Panel
  {
    std::string label;
    std::vector<Surface> surfaces;
  };

  std::string name;   ///< file name without ending
  std::string title;
  Eigen::Vector3d view{0, 1, 0}, up{0, 0, 1};
  int columns = 2;   ///< panels in a row
  std::vector<Panel> panels;
};

/// What a study gets to work with: the extent asked for, a progress line, and a place for its results.
class StudyContext
{
public:
  StudyContext(std::string study, bool quick, bool show_progress);
  ~StudyContext();
  StudyContext(const StudyContext&) = delete;
  StudyContext& operator=(const StudyContext&) = delete;

  bool quick() const { return quick_; }

  /// Restricts a study with numbered cases to these of them. With an empty list it runs all.
  void choose(std::vector<int> cases) { chosen_ = std::move(cases); }
  /// Returns the numbers of the cases to run: the chosen ones, or 0 to count - 1. A chosen number may exceed count.
  std::vector<int> cases(int count) const;

  /// Shows "study  done/total  what" on stderr: rewritten in place on a terminal, else a line every ten seconds.
  void progress(int done, int total, const std::string& what);
  void clearProgress();

  Row& row();                                                      ///< appends an empty row; the reference stays valid
  void metric(const std::string& key, double value);               ///< sets or replaces
  void note(const std::string& text) { notes_.push_back(text); }   ///< one line below the table
  Plot& plot(const std::string& name, const std::string& title, const std::string& x_label, const std::string& y_label);

  SurfacePicture& picture(const std::string& name, const std::string& title);

  /// Adds worst_error_over_bound = max |measured - expected| / bound over all check rows (NaN if any is NaN), if there
  /// are any.
  void finish();

  const std::string& name() const { return name_; }
  const std::deque<Row>& rows() const { return rows_; }
  const std::vector<std::pair<std::string, double>>& metrics() const { return metrics_; }
  const std::vector<std::string>& notes() const { return notes_; }
  const std::deque<Plot>& plots() const { return plots_; }
  const std::deque<SurfacePicture>& pictures() const { return pictures_; }

private:
  std::string name_;
  std::vector<int> chosen_;
  bool quick_, show_progress_, on_terminal_, line_shown_ = false;
  std::chrono::steady_clock::time_point last_progress_;
  std::deque<Row> rows_;
  std::vector<std::pair<std::string, double>> metrics_;
  std::vector<std::string> notes_;
  std::deque<Plot> plots_;
  std::deque<SurfacePicture> pictures_;
};

struct Study
{
  std::string name;
  std::string description;   ///< one line
  std::function<void(StudyContext&)> run;
  bool numbered = false;   ///< its cases have numbers, by which some of them can be run alone
};

/// Returns the numbers of a list such as "7,12,20-24". Throws std::invalid_argument for anything else.
std::vector<int> parseCases(const std::string& list);

/// Makes a study known to studies(). Each study has one object of this class beside its function.
struct StudyRegistration
{
  StudyRegistration(const char* name, const char* description, void (*run)(StudyContext&), bool numbered = false);
};

/// All studies, sorted by name.
const std::vector<Study>& studies();

/// nullptr when there is none of this name.
const Study* findStudy(const std::string& name);

}   // namespace slender::study
