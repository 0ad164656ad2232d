#pragma once

#include <deque>
#include <string>
#include <utility>
#include <vector>

#include "slender_sim/study/bars.h"
#include "slender_sim/study/study.h"

namespace slender::study {

/// How a value is printed: multiplied by `scale`, with `digits` significant digits, followed by `name`.
struct Unit
{
  double scale = 1.0;
  const char* name = "";
  int digits = 2;   ///< 0: a whole number
};

inline constexpr Unit kNumber{1.0, "", 2}, kCount{1.0, "", 0}, kPercent{100.0, " %", 2}, kTimes{1.0, " times", 2};

/// A number of a study's result, or the least and greatest of several.
struct Figure
{
  enum class From
  {
    metric,          ///< the metric `key`; a `*` at the end of `key` stands for any ending
    rows,            ///< the column `key` of the rows
    relative_error   ///< the largest |measured / expected - 1| of the rows; `key` is not used
  };

  std::string key{};
  std::string label{};   ///< printed before the value, where a headline has several figures
  From from = From::metric;
  std::string column{};   ///< rows, relative_error: only rows whose `column` has `text`; empty: all rows
  std::string text{};
  bool other = false;   ///< only the rows that have another text there
};

/// A line of the page of results: what a study measured, beside what it is compared with.
struct Headline
{
  std::string study;
  std::string what;              ///< what the figures are
  std::vector<Figure> figures;   ///< the bars of their metrics are the headline's targets
  Unit unit;
  std::string peer;                   ///< published value or other comparison, with its source; empty: none
  std::string meaning;                ///< one sentence: what the figure means to a user
  Bar::Form form = Bar::Form::both;   ///< full: the quick form does not have these figures
};

/// Makes headlines known. Each folder of studies has one object of this class.
struct HeadlineRegistration
{
  explicit HeadlineRegistration(std::vector<Headline> headlines);
};

/// All headlines. Those of a study are in the order in which they are printed.
const std::vector<Headline>& headlines();

/// What is measured by hand, because it needs a ROS master or another program than `study`.
struct HandMeasured
{
  std::string program, what, measured, peer, meaning;
  std::string version;   ///< of the package, when it was measured
};

const std::vector<HandMeasured>& handMeasured();

/// The numbers of a result, as the study left them or as its file tells them.
struct ResultValues
{
  const std::vector<std::pair<std::string, double>>& metrics;
  const std::deque<Row>& rows;
};

struct FigureValue
{
  bool found = false;               ///< the result has the metric, or a row with the column
  double least = 0.0, most = 0.0;   ///< NaN if any of the values is not a number
};

FigureValue valueOf(const Figure& figure, const ResultValues& result);

/// Returns "Q of the headline H is missing." for every figure that the result of this study must have and does not.
std::vector<std::string> missingFigures(const StudyContext& context);

/// Returns the value in this unit, e.g. "1,114" or "0.13 %"; "not a number" for NaN.
std::string printed(double value, const Unit& unit);

/// Returns the limit of a bar, e.g. "at most 0.5 %", or "0" where at most 0 is allowed.
std::string printedTarget(const Bar& bar, const Unit& unit);

/// Returns the value as the other form does. If rounding makes a missed bar look met, or a met one missed, more digits
/// are printed.
std::string printed(double value, const Unit& unit, const Bar& bar);

}   // namespace slender::study
