#pragma once

#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <system_error>

#include "slender_sim/dynamics/failure_place.h"

namespace slender {

/// The whole text as a decimal number (1, -2.5, 1e6, +3, also YAML's .inf and .nan), whatever the locale; nothing if it
/// is not one. Too large to represent gives infinity.
inline std::optional<double> parseNumber(const std::string& text)
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

}   // namespace slender
