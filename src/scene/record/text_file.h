#pragma once

#include <cerrno>
#include <charconv>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>

#include "slender_sim/geometry/pose.h"
#include "slender_sim/scene/file_paths.h"

namespace slender {

/// A text file written through a buffer; every failure is an exception: WriteError once it is open.
class TextFile
{
public:
  explicit TextFile(std::string path) : path_(std::move(path)), file_(path_, std::ios::binary | std::ios::trunc)
  {
    if (!file_)
      throw std::runtime_error(path_ + ": cannot be opened for writing: " + std::strerror(errno));
  }

  /// Adds a cell to the line: a text, or a number with as few digits as give it back. Vectors take three cells, and
  /// poses seven: position and quaternion [x, y, z, w].
  template <class Value>
  void cell(const Value& value)
  {
    if constexpr (std::is_same_v<Value, Pose>)
    {
      cell(value.position);
      for (const double entry : value.orientation.coeffs())
        cell(entry);
    }
    else if constexpr (std::is_arithmetic_v<Value>)
    {
      char buffer[40];
      const auto end = std::to_chars(buffer, buffer + sizeof buffer, value);
      cell(std::string_view(buffer, static_cast<std::size_t>(end.ptr - buffer)));
    }
    else if constexpr (std::is_convertible_v<const Value&, std::string_view>)
    {
      line_ += begun_ ? "," : "";
      line_ += value;
      begun_ = true;
    }
    else
    {
      for (int k = 0; k < 3; ++k)
        cell(value[k]);
    }
  }
  void endLine()
  {
    line_ += '\n';
    file_.write(line_.data(), static_cast<std::streamsize>(line_.size()));
    line_.clear();
    begun_ = false;
    check();
  }
  /// A whole line.
  template <class... Values>
  void row(const Values&... values)
  {
    (cell(values), ...);
    endLine();
  }
  void close()
  {
    file_.close();
    check();
  }

private:
  void check()
  {
    if (!file_)
      throw WriteError(path_ + ": writing failed: " + std::strerror(errno));
  }

  std::string path_;
  std::ofstream file_;
  std::string line_;
  bool begun_ = false;   ///< the line has a cell
};

}   // namespace slender
