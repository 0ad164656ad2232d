#include "state_bits.h"

#include <cstring>

namespace slender::study {

namespace {

template <class Numbers>
bool same(const Numbers& a, const Numbers& b)
{
  return a.size() == b.size() && (a.size() == 0 || std::memcmp(a.data(), b.data(), sizeof(*a.data()) * static_cast<std::size_t>(a.size())) == 0);
}

bool same(double a, double b) { return std::memcmp(&a, &b, sizeof a) == 0; }

}  // namespace

static bool sameBits(const Pose& a, const Pose& b) { return same(a.position, b.position) && same(a.orientation.coeffs(), b.orientation.coeffs()); }

static bool sameBits(const GraspState& a, const GraspState& b)
{
  return a.active == b.active && a.first_node == b.first_node && a.last_node == b.last_node && sameBits(a.X_WG, b.X_WG) &&
         same(a.section_twist[0], b.section_twist[0]) && same(a.section_twist[1], b.section_twist[1]);
}

static bool sameBits(const ThreadEnd& a, const ThreadEnd& b) { return a.held == b.held && sameBits(a.X_WE, b.X_WE); }

static bool sameBits(const ThreadState& a, const ThreadState& b)
{
  return same(a.x, b.x) && same(a.v, b.v) && same(a.d1, b.d1) && same(a.twist, b.twist) && same(a.spin, b.spin) && same(a.volume, b.volume) &&
         same(a.id, b.id) && same(a.deposited, b.deposited) && sameBits(a.ends[0], b.ends[0]) && sameBits(a.ends[1], b.ends[1]) &&
         a.next_id == b.next_id && a.thread_id == b.thread_id && same(a.fed_volume, b.fed_volume) && same(a.dropped_volume, b.dropped_volume);
}

template <class Part>
static bool sameParts(const std::vector<Part>& a, const std::vector<Part>& b)
{
  bool equal = a.size() == b.size();
  for (std::size_t k = 0; equal && k < a.size(); ++k)
    equal = sameBits(a[k], b[k]);
  return equal;
}

bool sameBits(const RodState& a, const RodState& b)
{
  return same(a.x, b.x) && same(a.v, b.v) && same(a.d1, b.d1) && same(a.twist, b.twist) && sameParts(a.grasps, b.grasps) && same(a.last_step, b.last_step) &&
         same(a.next_step, b.next_step) && same(a.a, b.a) && same(a.x_previous, b.x_previous) && same(a.v_previous, b.v_previous) &&
         same(a.strain_rate, b.strain_rate) && same(a.strain_rate_previous, b.strain_rate_previous) && same(a.strain_previous, b.strain_previous);
}

bool sameBits(const ClothState& a, const ClothState& b)
{
  return same(a.x, b.x) && same(a.v, b.v) && same(a.rest_angles, b.rest_angles) && same(a.stiffening, b.stiffening) && same(a.pins, b.pins) &&
         a.average_set == b.average_set && same(a.at_bound, b.at_bound) && same(a.next_step, b.next_step);
}

bool sameBits(const SceneCloth& a, const SceneCloth& b)
{
  return sameBits(a.cloth, b.cloth) && same(a.guide, b.guide) && same(a.guide_velocity, b.guide_velocity) && same(a.guide_forces, b.guide_forces) &&
         same(a.blend.gap, b.blend.gap) && same(a.blend.rate, b.blend.rate) && same(a.blend.start, b.blend.start) &&
         same(a.blend.duration, b.blend.duration);
}

bool sameBits(const ThreadGroupState& a, const ThreadGroupState& b)
{
  return sameParts(a.threads, b.threads) && a.next_thread_id == b.next_thread_id && same(a.dropped_volume, b.dropped_volume);
}

bool sameBits(const SceneState& a, const SceneState& b)
{
  return same(a.time, b.time) && a.steps == b.steps && sameParts(a.rods, b.rods) && sameParts(a.threads, b.threads) && sameParts(a.cloths, b.cloths);
}

}  // namespace slender::study
