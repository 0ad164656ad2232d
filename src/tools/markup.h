#pragma once

#include <string>

namespace slender {

/// Returns the text with the characters that have a meaning in HTML and XML replaced by their names.
inline std::string escaped(const std::string& text)
{
  std::string out;
  for (const char c : text)
    out += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '>' ? "&gt;" : c == '"' ? "&quot;" : std::string(1, c);
  return out;
}

}   // namespace slender
