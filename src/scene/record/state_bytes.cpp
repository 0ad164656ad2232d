#include "slender_sim/scene/state_bytes.h"

#include <cmath>
#include <stdexcept>
#include <type_traits>
#include <vector>

#include "byte_archive.h"
#include "state_fields.h"

namespace slender {

namespace {

/// Whether all numbers of a state are finite; visited as archives are.
class FiniteCheck
{
public:
  template <class T>
  void operator()(const T& value)
  {
    if constexpr (std::is_floating_point_v<T>)
      finite_ = finite_ && std::isfinite(value);
    else if constexpr (!std::is_arithmetic_v<T>)
      finite_ = finite_ && value.allFinite();
  }
  template <class T>
  void list(const std::vector<T>&)
  {
  }
  bool finite() const { return finite_; }

private:
  bool finite_ = true;
};

template <class State>
std::string bytesOf(const State& state)
{
  ByteWriter out;
  FieldVisitor<ByteWriter> visitor(out);
  visitor(state);
  return out.bytes();
}

}   // namespace

std::string stateBytes(const SceneState& state) { return bytesOf(state); }
std::string stateBytes(const RodState& state) { return bytesOf(state); }
std::string stateBytes(const ThreadGroupState& state) { return bytesOf(state); }
std::string stateBytes(const ClothState& state) { return bytesOf(state); }

bool allFinite(const SceneState& state)
{
  FiniteCheck numbers;
  FieldVisitor<FiniteCheck> visitor(numbers);
  visitor(state);
  return numbers.finite();
}

SceneState stateOfBytes(const char* bytes, std::size_t size)
{
  ByteReader reader(bytes, size);
  SceneState state;
  FieldVisitor<ByteReader> visitor(reader);
  visitor(state);
  if (reader.left() != 0)
    throw std::runtime_error("has bytes after its end");
  if (!allFinite(state))
    throw std::runtime_error("holds numbers that are not finite");
  return state;
}

}   // namespace slender
