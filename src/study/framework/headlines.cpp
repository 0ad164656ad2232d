#include "slender_sim/study/headlines.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>

namespace slender::study {

namespace {

std::vector<Headline>& registeredHeadlines()
{
  static std::vector<Headline> all;
  return all;
}

void add(double value, FigureValue& to)
{
  if (!to.found)
    to = {true, value, value};
  else if (std::isnan(value) || std::isnan(to.least))
    to.least = to.most = std::numeric_limits<double>::quiet_NaN();
  else
    to = {true, std::min(to.least, value), std::max(to.most, value)};
}

/// Returns true if the row is one of those that the figure is about.
bool concerns(const Figure& figure, const Row& row)
{
  if (figure.column.empty())
    return true;
  const Row::Value* value = row.find(figure.column);
  const std::string* text = value ? std::get_if<std::string>(value) : nullptr;
  return text && (*text == figure.text) != figure.other;
}

void addRow(const Figure& figure, const Row& row, FigureValue& to)
{
  const bool relative = figure.from == Figure::From::relative_error;
  const Row::Value* value = row.find(relative ? "measured" : figure.key);
  const double* number = value ? std::get_if<double>(value) : nullptr;
  if (!number)
    return;
  if (!relative)
    return add(*number, to);
  const Row::Value* expected = row.find("expected");
  const double* exact = expected ? std::get_if<double>(expected) : nullptr;
  if (exact && *exact != 0.0)
    add(std::abs(*number / *exact - 1.0), to);
}

/// Returns the digits of a number without a sign in groups of three.
std::string grouped(const std::string& digits)
{
  const std::size_t whole = std::min(digits.find('.'), digits.size());
  std::string out;
  for (std::size_t k = 0; k < whole; ++k)
    out += (k && (whole - k) % 3 == 0 ? "," : "") + std::string(1, digits[k]);
  return out + digits.substr(whole);
}

/// Returns what printf() wrote as one would write it: 12,000 and 1e-9, not 12000 and 1e-09.
std::string tidied(const std::string& number)
{
  const std::size_t exponent = number.find('e');
  return exponent == std::string::npos
             ? grouped(number)
             : number.substr(0, exponent) + "e" + std::to_string(std::atoi(number.c_str() + exponent + 1));
}

/// Returns the number with so many significant digits, and what it is after rounding.
std::string rounded(double value, int digits, double& after)
{
  const double size = std::abs(value);
  char text[64];
  if (digits == 0)
    std::snprintf(text, sizeof text, "%.0f", size);
  else if (size != 0 && !(size >= 1e-3 && size < 1e7))
    std::snprintf(text, sizeof text, "%.*e", digits - 1, size);
  else
    std::snprintf(text, sizeof text, "%.*f",
                  size == 0 ? 0 : std::max(0, digits - 1 - static_cast<int>(std::floor(std::log10(size)))), size);
  after = std::copysign(std::strtod(text, nullptr), value);
  const std::string number = tidied(text);
  return (value < 0 && after != 0 ? "-" : "") + number;
}

}   // namespace

HeadlineRegistration::HeadlineRegistration(std::vector<Headline> headlines)
{
  registeredHeadlines().insert(registeredHeadlines().end(), headlines.begin(), headlines.end());
}

const std::vector<Headline>& headlines() { return registeredHeadlines(); }

FigureValue valueOf(const Figure& figure, const ResultValues& result)
{
  FigureValue value;
  if (figure.from != Figure::From::metric)
  {
    for (const Row& row : result.rows)
      if (concerns(figure, row))
        addRow(figure, row, value);
    return value;
  }
  const Bar names{"", figure.key};   // the same use of `*`
  for (const auto& [name, number] : result.metrics)
    if (names.concerns(name))
      add(number, value);
  return value;
}

std::vector<std::string> missingFigures(const StudyContext& context)
{
  std::vector<std::string> missing;
  for (const Headline& headline : headlines())
    if (headline.study == context.name() && !(context.quick() && headline.form == Bar::Form::full))
      for (const Figure& figure : headline.figures)
        if (!valueOf(figure, {context.metrics(), context.rows()}).found)
          missing.push_back("The figure " + (figure.key.empty() ? "of relative errors" : figure.key) +
                            " of the headline \"" + headline.what + "\" is missing.");
  return missing;
}

std::string printed(double value, const Unit& unit)
{
  if (!std::isfinite(value))
    return std::isnan(value) ? "not a number" : "infinite";
  double after = 0.0;
  return rounded(value * unit.scale, unit.digits, after) + unit.name;
}

std::string printedTarget(const Bar& bar, const Unit& unit)
{
  const double limit = bar.limit * unit.scale;
  char text[32];
  std::snprintf(text, sizeof text, "%g", limit);
  const std::string sense = bar.sense == Bar::Sense::at_least ? "at least " : bar.limit == 0.0 ? "" : "at most ";
  return sense + tidied(text) + unit.name;
}

std::string printed(double value, const Unit& unit, const Bar& bar)
{
  if (!std::isfinite(value))
    return printed(value, unit);
  double after = 0.0;
  for (int digits = unit.digits; digits < 12; ++digits)
    if (const std::string text = rounded(value * unit.scale, digits, after);
        bar.metBy(after / unit.scale) == bar.metBy(value))
      return text + unit.name;
  return printed(value, unit);
}

}   // namespace slender::study
