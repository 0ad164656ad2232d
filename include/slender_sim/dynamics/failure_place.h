#pragma once

#include <string>

#include <Eigen/Core>

namespace slender {

/// The node of a failed step that is farthest from a solution. Simulation::step() names what is near it.
struct FailurePlace
{
  enum class Kind
  {
    none,
    rod,
    thread,
    cloth
  };
  Kind kind = Kind::none;
  std::string name;                    ///< of the rod, thread or cloth
  int node = -1;                       ///< node of the rod or thread, vertex of the cloth
  Eigen::Vector3d position{0, 0, 0};   ///< [m] of the node as the step began: trial positions may be anywhere
};

/// The largest of the values that were added, and where it is. A value that is not finite counts as larger than all
/// others; of several the first is kept.
class Largest
{
public:
  void add(int index, double value);
  bool any() const { return index_ >= 0; }
  int index() const { return index_; }   ///< -1: nothing was added
  double value() const { return value_; }
  /// "1.2e+03 N", or "infinite" for a value that is not finite.
  std::string text(const std::string& unit) const;

private:
  int index_ = -1;
  double value_ = -1.0;
};

/// Returns a number as text with at most `digits` significant digits, without trailing zeros: "0.0015", "1.5e-07".
std::string shortNumber(double value, int digits = 10);

/// "(0.1, -2, 0.3) m", for messages.
std::string metres(const Eigen::Vector3d& position);

}   // namespace slender
