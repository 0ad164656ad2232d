#pragma once

#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <string>

/// Values on the command lines of the programs.
namespace slender {

/// What() says which option or file is bad, and what it must be.
struct BadInput : std::runtime_error
{
  using std::runtime_error::runtime_error;
};

/// The whole text as a finite number.
inline bool parseNumber(const std::string& text, double& value)
{
  std::size_t end = 0;
  try
  {
    value = std::stod(text, &end);
  }
  catch (const std::exception&)
  {
    return false;
  }
  return end == text.size() && std::isfinite(value);
}

/// Of (0, high].
inline double parsePositive(const std::string& option, const std::string& text, double high = 1e12)
{
  double value = 0.0;
  if (parseNumber(text, value) && value > 0 && value <= high)
    return value;
  char range[32];
  std::snprintf(range, sizeof range, "(0, %g]", high);
  throw BadInput(option + " " + text + ": must be a number in " + range);
}

/// Of [low, high].
inline int parseCount(const std::string& option, const std::string& text, int low, int high)
{
  double value = 0.0;
  if (!parseNumber(text, value) || value != std::floor(value) || value < low || value > high)
    throw BadInput(option + " " + text + ": must be a whole number in [" + std::to_string(low) + ", " +
                   std::to_string(high) + "]");
  return static_cast<int>(value);
}

}   // namespace slender
