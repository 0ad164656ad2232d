#pragma once

#include <cstdint>
#include <random>

#include "read_parts.h"

/// Generators of the scene file: each reads its parameters and expands into plain rods, obstacles and bodies.
namespace slender {

void generateChain(const YamlCursor& at, const ReadContext& context, Generated& out);
void generateTree(const YamlCursor& at, const ReadContext& context, int first_rod, Generated& out);
void generateHair(const YamlCursor& at, const ReadContext& context, Generated& out);

/// Numbers that are the same on every machine for a seed (the distributions of <random> are not).
class Dice
{
public:
  explicit Dice(int seed) : engine_(static_cast<std::uint64_t>(seed)) {}
  double between(double low, double high)
  {
    return low + (high - low) * (static_cast<double>(engine_() >> 11) * 0x1p-53);
  }

private:
  std::mt19937_64 engine_;
};

/// A direction of the scene file as a unit vector.
Eigen::Vector3d readDirection(const YamlCursor& at, const Eigen::Vector3d& otherwise);

constexpr double kGoldenAngle = 2.399963229728653;   // [rad] successive turns by it never line up

}   // namespace slender
