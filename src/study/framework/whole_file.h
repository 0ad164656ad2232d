#pragma once

#include <fstream>
#include <sstream>
#include <string>

namespace slender {

/// Returns all bytes of a file, or an empty text if it cannot be read.
inline std::string wholeFile(const std::string& path)
{
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

}   // namespace slender
