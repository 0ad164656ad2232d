#include "slender_sim/study/study.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numeric>
#include <sstream>
#include <stdexcept>

#include <unistd.h>

namespace slender::study {

Row& Row::set(const std::string& key, double value)
{
  for (auto& entry : entries_)
    if (entry.first == key)
    {
      entry.second = value;
      return *this;
    }
  entries_.emplace_back(key, value);
  return *this;
}

Row& Row::set(const std::string& key, const std::string& value)
{
  for (auto& entry : entries_)
    if (entry.first == key)
    {
      entry.second = value;
      return *this;
    }
  entries_.emplace_back(key, value);
  return *this;
}

Row& Row::check(double measured, double expected, double bound, const std::string& source)
{
  if (!(bound > 0.0))
    throw std::invalid_argument("study: bound must be positive, got " + std::to_string(bound) + " for " + source);
  return set("measured", measured)
      .set("expected", expected)
      .set("bound", bound)
      .set("error_over_bound", std::abs(measured - expected) / bound)
      .set("source", source);
}

const Row::Value* Row::find(const std::string& key) const
{
  for (const auto& entry : entries_)
    if (entry.first == key)
      return &entry.second;
  return nullptr;
}

Series& Plot::at(const std::string& label)
{
  for (Series& s : series)
    if (s.label == label)
      return s;
  series.push_back({label, {}, {}});
  return series.back();
}

std::vector<int> parseCases(const std::string& list)
{
  constexpr int kMost = 1000000;
  const auto number = [&](const std::string& digits) {
    const bool sound = !digits.empty() && digits.size() < 8 && digits.find_first_not_of("0123456789") == digits.npos;
    const int value = sound ? std::stoi(digits) : kMost;
    if (value >= kMost)
      throw std::invalid_argument("'" + list + "' is no list of numbers below " + std::to_string(kMost) +
                                  " such as 7,12,20-24");
    return value;
  };
  std::vector<int> cases;
  std::istringstream words(list + ",");
  for (std::string word; std::getline(words, word, ',');)
  {
    const std::size_t dash = word.find('-');
    const int first = number(word.substr(0, dash)), last = dash == word.npos ? first : number(word.substr(dash + 1));
    for (int k = first; k <= last; ++k)
      cases.push_back(k);
  }
  if (cases.empty())
    number("");   // a range that runs backwards
  return cases;
}

StudyContext::StudyContext(std::string study, bool quick, bool show_progress)
  : name_(std::move(study)),
    quick_(quick),
    show_progress_(show_progress),
    on_terminal_(isatty(STDERR_FILENO) == 1),
    last_progress_(std::chrono::steady_clock::now())
{
}

StudyContext::~StudyContext() { clearProgress(); }

std::vector<int> StudyContext::cases(int count) const
{
  if (!chosen_.empty())
    return chosen_;
  std::vector<int> all(static_cast<std::size_t>(count));
  std::iota(all.begin(), all.end(), 0);
  return all;
}

void StudyContext::progress(int done, int total, const std::string& what)
{
  if (!show_progress_)
    return;
  const auto now = std::chrono::steady_clock::now();
  const double elapsed = std::chrono::duration<double>(now - last_progress_).count();
  if (elapsed < (on_terminal_ ? 0.05 : 10.0))
    return;
  last_progress_ = now;
  std::fprintf(stderr, on_terminal_ ? "\r%s  %d/%d  %s\033[K" : "%s  %d/%d  %s\n", name_.c_str(), done, total,
               what.c_str());
  std::fflush(stderr);
  line_shown_ = on_terminal_;
}

void StudyContext::clearProgress()
{
  if (line_shown_)
    std::fputs("\r\033[K", stderr);
  line_shown_ = false;
}

Row& StudyContext::row()
{
  rows_.emplace_back();
  return rows_.back();
}

void StudyContext::metric(const std::string& key, double value)
{
  for (auto& m : metrics_)
    if (m.first == key)
    {
      m.second = value;
      return;
    }
  metrics_.emplace_back(key, value);
}

Plot& StudyContext::plot(const std::string& name, const std::string& title, const std::string& x_label,
                         const std::string& y_label)
{
  Plot& plot = plots_.emplace_back();
  plot.name = name;
  plot.title = title;
  plot.x_label = x_label;
  plot.y_label = y_label;
  return plot;
}

SurfacePicture& StudyContext::picture(const std::string& name, const std::string& title)
{
  SurfacePicture& picture = pictures_.emplace_back();
  picture.name = name;
  picture.title = title;
  return picture;
}

void StudyContext::finish()
{
  clearProgress();
  double worst = 0.0;
  bool any = false;
  for (const Row& r : rows_)
  {
    const Row::Value* ratio = r.find("error_over_bound");
    if (!ratio || !std::holds_alternative<double>(*ratio))
      continue;
    any = true;
    const double value = std::get<double>(*ratio);
    if (std::isnan(value) || std::isnan(worst))
      worst = std::numeric_limits<double>::quiet_NaN();   // a check without a number is no success
    else
      worst = std::max(worst, value);
  }
  if (any)
    metric("worst_error_over_bound", worst);
}

}   // namespace slender::study
