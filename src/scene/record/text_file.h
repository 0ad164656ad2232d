#pragma once

#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include <Eigen/Core>

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

  TextFile& operator<<(const std::string& text)
  {
    line_ += text;
    return *this;
  }
  TextFile& operator<<(const char* text)
  {
    line_ += text;
    return *this;
  }
  TextFile& operator<<(char c)
  {
    line_ += c;
    return *this;
  }
  template <class Number>
  TextFile& number(Number value)
  {
    char buffer[40];
    const auto end = std::to_chars(buffer, buffer + sizeof buffer, value);
    line_.append(buffer, end.ptr);
    return *this;
  }
  TextFile& vector(const Eigen::Vector3d& v, char separator)
  {
    number(v.x()) << separator;
    number(v.y()) << separator;
    return number(v.z());
  }
  void endLine()
  {
    line_ += '\n';
    file_.write(line_.data(), static_cast<std::streamsize>(line_.size()));
    line_.clear();
    check();
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
};

}   // namespace slender
