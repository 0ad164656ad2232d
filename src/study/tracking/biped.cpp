#include "biped.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace slender::study {

using Eigen::Vector3d;

namespace {

enum Body
{
  hips,
  chest,
  right_upper_arm,
  right_forearm,
  left_upper_arm,
  left_forearm,
  right_thigh,
  right_shin,
  right_foot,
  left_thigh,
  left_shin,
  left_foot,
  kBodies
};

// Of the outline [m]: half widths and heights of the trunk, arms and legs in the plane y, z before they are drawn apart
// to an X.
constexpr double kHip = 0.76, kWaist = 1.02, kArmLow = 1.12, kTop = 1.28, kTrunk = 0.18, kArm = 0.56, kLegInside = 0.02;
constexpr double kElbow = kTrunk + 0.28, kKnee = 0.40, kAnkle = 0.10;
constexpr double kArmSlope = -0.6, kLegSlope = 0.12;
constexpr double kBlend = 0.06;   // over which bodies share vertices, to both sides of a joint

/// Where a point of the pattern is at rest, but for the thickness.
Vector3d drawnApart(double y, double z)
{
  const double side = y < 0 ? -1.0 : 1.0, out = std::abs(y) - kTrunk;
  if (out > 0)
    return {0, y, z + kArmSlope * out};
  if (z < kHip)
    return {0, y + side * kLegSlope * (kHip - z), z};
  return {0, y, z};
}

/// How far a point lies beyond a joint, as a share of 1 for the body beyond it.
double beyond(double distance) { return std::clamp(0.5 + 0.5 * distance / kBlend, 0.0, 1.0); }

std::array<double, kBodies> sharesAt(double y, double z)
{
  std::array<double, kBodies> share{};
  const bool left = y > 0;
  const double out = std::abs(y) - kTrunk;
  const double arm = z > kArmLow - 1e-9 ? beyond(out) : 0.0, leg = beyond(kHip - z);
  const double forearm = beyond(std::abs(y) - kElbow), shin = beyond(kKnee - z), foot = beyond(kAnkle - z),
               upper = beyond(z - kWaist);
  const double trunk = (1 - arm) * (1 - leg);
  share[hips] = trunk * (1 - upper);
  share[chest] = trunk * upper;
  share[left ? left_upper_arm : right_upper_arm] = arm * (1 - forearm);
  share[left ? left_forearm : right_forearm] = arm * forearm;
  // of both legs, at the trunk
  const double mine = z < kHip - 1e-9 ? 1.0 : std::clamp(0.5 + 0.5 * std::abs(y) / kBlend, 0.0, 1.0);
  share[left ? left_thigh : right_thigh] = leg * (1 - arm) * (1 - shin) * mine;
  share[left ? right_thigh : left_thigh] = leg * (1 - arm) * (1 - shin) * (1 - mine);
  share[left ? left_shin : right_shin] = leg * (1 - arm) * shin * (1 - foot);
  share[left ? left_foot : right_foot] = leg * (1 - arm) * shin * foot;
  return share;
}

Pose turnedAbout(const Vector3d& joint, const Eigen::Quaterniond& turn) { return {joint - turn * joint, turn}; }
Eigen::Quaterniond about(const Vector3d& axis, double angle)
{
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis));
}

}   // namespace

Biped::Biped(double cell)
{
  const auto cells = [&](double length) { return static_cast<int>(std::lround(length / cell)); };
  const int trunk = cells(kTrunk), inside = cells(kLegInside), reach = cells(kTrunk + kArm), hip = cells(kHip),
            arm = cells(kArmLow), top = cells(kTop);
  const auto used = [&](int i, int j) {   // cell from i to i + 1 across, j to j + 1 up
    const int out = i < 0 ? -i - 1 : i;
    if (j < 0 || j >= top || out >= reach)
      return false;
    return j < hip ? out >= inside && out < trunk : out < trunk || j >= arm;
  };
  const auto isInner = [&](int i, int j) {
    return used(i, j) && used(i - 1, j) && used(i, j - 1) && used(i - 1, j - 1);
  };

  std::vector<Eigen::Vector2d> outline;
  for (int j = 0; j <= top; ++j)
    for (int i = -reach; i <= reach; ++i)
      if (!isInner(i, j) && (used(i, j) || used(i - 1, j) || used(i, j - 1) || used(i - 1, j - 1)))
        outline.emplace_back(i * cell, j * cell);

  std::map<std::array<int, 3>, int> number;
  std::vector<Vector3d> vertices;
  std::vector<std::array<double, kBodies>> shares;
  const auto vertex = [&](int i, int j, int sheet) {
    const bool inner = isInner(i, j);
    const auto [at, fresh] = number.try_emplace({i, j, inner ? sheet : 0}, static_cast<int>(vertices.size()));
    if (fresh)
    {
      const double y = i * cell, z = j * cell;
      double distance = 1e300;
      for (const Eigen::Vector2d& o : outline)
        distance = std::min(distance, (o - Eigen::Vector2d(y, z)).norm());
      const double s = std::min(distance / 0.08, 1.0), thickness = 0.06 * std::sqrt(1.0 - (1.0 - s) * (1.0 - s));
      vertices.push_back(drawnApart(y, z) + Vector3d(inner ? (sheet ? -thickness : thickness) : 0.0, 0, 0));
      shares.push_back(sharesAt(y, z));
    }
    return at->second;
  };
  std::vector<Eigen::Vector3i> faces;
  for (int sheet = 0; sheet < 2; ++sheet)
    for (int j = 0; j < top; ++j)
      for (int i = -reach; i < reach; ++i)
      {
        if (!used(i, j))
          continue;
        const int a = vertex(i, j, sheet), b = vertex(i + 1, j, sheet), c = vertex(i + 1, j + 1, sheet),
                  d = vertex(i, j + 1, sheet);
        // by turns, but no edge within a sheet joins two vertices of the outline: the other sheet would have it, too
        const bool rises = isInner(i, j) || isInner(i + 1, j + 1), falls = isInner(i + 1, j) || isInner(i, j + 1);
        const bool rising = rises && (!falls || (i + j) % 2 == 0);
        Eigen::Vector3i one = rising ? Eigen::Vector3i(a, b, c) : Eigen::Vector3i(a, b, d);
        Eigen::Vector3i two = rising ? Eigen::Vector3i(a, c, d) : Eigen::Vector3i(b, c, d);
        if (sheet)   // faces backwards
        {
          std::swap(one[1], one[2]);
          std::swap(two[1], two[2]);
        }
        faces.push_back(one);
        faces.push_back(two);
      }
  mesh_.vertices.resize(3, static_cast<Eigen::Index>(vertices.size()));
  mesh_.triangles.resize(3, static_cast<Eigen::Index>(faces.size()));
  std::vector<GuideBinding::Share> all;
  for (std::size_t v = 0; v < vertices.size(); ++v)
  {
    mesh_.vertices.col(static_cast<Eigen::Index>(v)) = vertices[v];
    for (int b = 0; b < kBodies; ++b)
      if (shares[v][b] > 0)
        all.push_back({static_cast<int>(v), b, shares[v][b]});
  }
  for (std::size_t f = 0; f < faces.size(); ++f)
  {
    mesh_.triangles.col(static_cast<Eigen::Index>(f)) = faces[f];
    std::array<double, kBodies> sum{};
    for (const int v : faces[f])
      for (int b = 0; b < kBodies; ++b)
        sum[b] += shares[v][b];
    body_of_face_.push_back(static_cast<int>(std::max_element(sum.begin(), sum.end()) - sum.begin()));
  }
  // all at the origin: poses are moves from the rest shape
  binding_.emplace(mesh_.vertices, std::vector<Pose>(kBodies), all);
}

std::vector<Pose> Biped::poses(double t) const
{
  const double begun = std::clamp(t / 0.25, 0.0, 1.0),
               ease = begun * begun * begun * (10 - 15 * begun + 6 * begun * begun);
  const Vector3d sideways = Vector3d::UnitY();
  std::vector<Pose> pose(kBodies);
  const double phase = 2 * M_PI * t / kPeriod;
  const Pose root{{kWalkSpeed * std::max(0.0, t - 0.125 * (1 - ease)) * ease, 0, 0.015 * ease * std::cos(2 * phase)},
                  Eigen::Quaterniond::Identity()};
  pose[hips] = root;
  pose[chest] = root * turnedAbout({0, 0, kWaist}, about(Vector3d::UnitZ(), 0.12 * ease * std::cos(phase)));
  for (const bool left : {false, true})
  {
    const double p = phase + (left ? M_PI : 0.0), side = left ? 1.0 : -1.0;
    const Vector3d shoulder = drawnApart(side * kTrunk, 0.5 * (kArmLow + kTop)),
                   elbow = drawnApart(side * kElbow, 0.5 * (kArmLow + kTop));
    const Vector3d hip(0, side * 0.1, kHip), knee = drawnApart(side * 0.1, kKnee),
                                             ankle = drawnApart(side * 0.1, kAnkle);
    const Eigen::Quaterniond lowered = about(Vector3d::UnitX(), -side * 0.45 * ease);
    // turned about y by -a, what hangs goes forwards
    pose[left ? left_upper_arm : right_upper_arm] =
        pose[chest] * turnedAbout(shoulder, about(sideways, -ease * kShoulderSwing.at(p)) * lowered);
    pose[left ? left_forearm : right_forearm] =
        pose[left ? left_upper_arm : right_upper_arm] * turnedAbout(elbow, about(sideways, -ease * kElbowSwing.at(p)));
    pose[left ? left_thigh : right_thigh] = root * turnedAbout(hip, about(sideways, -ease * kHipSwing.at(p)));
    pose[left ? left_shin : right_shin] =
        pose[left ? left_thigh : right_thigh] * turnedAbout(knee, about(sideways, ease * kKneeSwing.at(p)));
    pose[left ? left_foot : right_foot] =
        pose[left ? left_shin : right_shin] *
        turnedAbout(ankle, about(sideways, ease * 0.6 * (kHipSwing.at(p) - kKneeSwing.at(p))));
  }
  return pose;
}

Eigen::Matrix3Xd Biped::at(double t) const
{
  Eigen::Matrix3Xd x;
  binding_->place(poses(t), x);
  return x;
}

}   // namespace slender::study
