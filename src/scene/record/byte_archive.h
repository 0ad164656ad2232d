#pragma once

#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include <Eigen/Core>

/// Numbers, matrices and lists to bytes and back, bit by bit. Both directions are called with the same visit()
/// function, so that they cannot drift apart. Private to saving and loading of states.
namespace slender {

class ByteWriter
{
public:
  template <class T>
  void operator()(const T& value)
  {
    if constexpr (std::is_arithmetic_v<T>)
    {
      const std::size_t at = bytes_.size();
      bytes_.resize(at + sizeof(T));
      std::memcpy(&bytes_[at], &value, sizeof(T));
    }
    else if constexpr (std::is_enum_v<T>)
    {
      (*this)(static_cast<int>(value));
    }
    else
    {
      (*this)(static_cast<std::int64_t>(value.rows()));
      (*this)(static_cast<std::int64_t>(value.cols()));
      const std::size_t at = bytes_.size(), size = static_cast<std::size_t>(value.size()) * sizeof(double);
      bytes_.resize(at + size);
      if (size > 0)
        std::memcpy(&bytes_[at], value.data(), size);
    }
  }

  template <class... T>
  void all(const T&... values)
  {
    ((*this)(values), ...);
  }

  template <class T>
  void list(const std::vector<T>& values)
  {
    (*this)(static_cast<std::uint64_t>(values.size()));
  }

  const std::string& bytes() const { return bytes_; }

private:
  std::string bytes_;
};

/// Throws std::runtime_error when the bytes end too early or a size cannot be true.
class ByteReader
{
public:
  ByteReader(const char* begin, std::size_t size) : at_(begin), end_(begin + size) {}

  template <class T>
  void operator()(T& value)
  {
    if constexpr (std::is_same_v<T, bool>)
    {
      unsigned char byte = 0;   // a bool of another value than 0 and 1 would be undefined
      take(&byte, 1);
      if (byte > 1)
        throw std::runtime_error("holds neither yes nor no where it must");
      value = byte == 1;
    }
    else if constexpr (std::is_arithmetic_v<T>)
    {
      take(&value, sizeof(T));
    }
    else
    {
      std::int64_t rows = 0, cols = 0;
      (*this)(rows);
      (*this)(cols);
      const std::int64_t limit = static_cast<std::int64_t>(left() / sizeof(double));
      const bool fits = rows >= 0 && cols >= 0 && (rows == 0 || cols <= limit / rows) &&
                        (T::RowsAtCompileTime == Eigen::Dynamic || rows == T::RowsAtCompileTime) &&
                        (T::ColsAtCompileTime == Eigen::Dynamic || cols == T::ColsAtCompileTime);
      if (!fits)
        throw std::runtime_error("holds a matrix of impossible size");
      value.resize(rows, cols);
      take(value.data(), static_cast<std::size_t>(value.size()) * sizeof(double));
    }
  }

  template <class T>
  void list(std::vector<T>& values)
  {
    std::uint64_t size = 0;
    (*this)(size);
    if (size > left())
      throw std::runtime_error("holds a list of impossible size");
    values.resize(size);
  }

  std::size_t left() const { return static_cast<std::size_t>(end_ - at_); }

private:
  void take(void* to, std::size_t size)
  {
    if (size > left())
      throw std::runtime_error("ends too early");
    if (size > 0)
    {
      std::memcpy(to, at_, size);
      at_ += size;
    }
  }

  const char* at_;
  const char* end_;
};

/// FNV-1a, 64 bits: tells damaged files, no protection against forgery.
class Checksum
{
public:
  void add(const void* data, std::size_t size)
  {
    const auto* bytes = static_cast<const unsigned char*>(data);
    for (std::size_t k = 0; k < size; ++k)
      value_ = (value_ ^ bytes[k]) * 0x100000001b3u;
  }
  std::uint64_t value() const { return value_; }

private:
  std::uint64_t value_ = 0xcbf29ce484222325u;
};

}   // namespace slender
