#include "slender_sim/rod/natural_frames.h"

#include <cmath>
#include <stdexcept>
#include <string>

namespace slender {

namespace {

void requireFinite(const RodModel& model, Eigen::Index entries, bool finite, const char* what)
{
  if (entries != model.nodes())
    throw std::invalid_argument("rod '" + model.name + "': " + what + " needs " + std::to_string(model.nodes()) +
                                " entries, got " + std::to_string(entries));
  if (!finite)
    throw std::invalid_argument("rod '" + model.name + "': " + what + " has an entry that is not finite");
}

/// The mean of both edges' directors in the thesis's curvature (3.14) is this times the director half way.
double meanDirector(const RodModel& model, double twist)
{
  return model.curvature == Curvature::tangent ? std::cos(0.5 * twist) : 1.0;
}

}   // namespace

Eigen::VectorXd evenTwist(const RodModel& model, double total)
{
  Eigen::VectorXd twist(model.nodes());
  for (int i = 0; i < model.nodes(); ++i)
    twist[i] = model.voronoiLength(i);
  return twist * (total / twist.sum());
}

void addNaturalTwist(RodModel& model, const Eigen::VectorXd& twist)
{
  requireFinite(model, twist.size(), twist.allFinite(), "natural twist");
  const double total = twist.sum();
  double turned = 0.0;   // of the frame of the edge after the node
  for (int i = 0; i < model.nodes(); ++i)
  {
    if (i > 0)
      turned += twist[i];
    const double old_mean = meanDirector(model, model.rest_twist[i]);
    if (std::abs(old_mean) < 1e-3)
      throw std::invalid_argument("rod '" + model.name + "': its natural frames twist by half a turn at node " +
                                  std::to_string(i) + "; use shorter edges");
    const double ratio = meanDirector(model, model.rest_twist[i] + twist[i]) / old_mean;
    const Eigen::Vector2d natural = ratio * model.rest_curvature.col(i);
    const auto inFrames = [&natural](double turn) { return Eigen::Vector2d(Eigen::Rotation2Dd(-turn) * natural); };
    const double half = 0.5 * twist[i];
    model.rest_curvature.col(i) = model.closed && i == 0
                                      ? Eigen::Vector2d(0.5 * (inFrames(total - half) + inFrames(-half)))
                                      : inFrames(turned - half);
    model.rest_twist[i] += twist[i];
  }
}

void setNaturalCurvature(RodModel& model, const Eigen::Matrix2Xd& curvature)
{
  requireFinite(model, curvature.cols(), curvature.allFinite(), "natural curvature");
  for (int i = 0; i < model.nodes(); ++i)
  {
    const double turn = curvature.col(i).norm() * model.voronoiLength(i);
    if (turn >= 2.0)
      throw std::invalid_argument("rod '" + model.name + "': its natural curvature turns the joint at node " +
                                  std::to_string(i) + " by " + std::to_string(turn) +
                                  " rad; must be less than 2: use shorter edges");
    // the strain of an arc as long as the joint: its turn, or the tangent of the half
    const double strain = model.curvature == Curvature::tangent ? 2.0 * std::tan(0.5 * turn) : turn;
    model.rest_curvature.col(i) =
        turn > 0 ? Eigen::Vector2d(curvature.col(i).normalized() * (strain * meanDirector(model, model.rest_twist[i])))
                 : Eigen::Vector2d::Zero();
  }
}

void turnFramesAlong(RodState& state, const Eigen::VectorXd& twist)
{
  const int n = static_cast<int>(state.x.cols()), edges = static_cast<int>(state.d1.cols());
  double turn = 0.0;
  for (int j = 0; j < edges; ++j)
  {
    if (j > 0)
      turn += twist[j];
    const Eigen::Vector3d t = (state.x.col((j + 1) % n) - state.x.col(j)).normalized();
    state.d1.col(j) = rotateAbout(state.d1.col(j), t, turn);
  }
  const bool closed = edges == n;
  for (int i = closed ? 0 : 1; i < (closed ? n : n - 1); ++i)
    state.twist[i] += twist[i];
}

bool isIsotropic(const RodModel& model)
{
  for (int i = 0; i < model.nodes(); ++i)
  {
    const Eigen::Vector3d b = model.bend_modulus.col(i);
    if (std::abs(b[0] - b[2]) > 1e-9 * (b[0] + b[2]) || std::abs(b[1]) > 1e-9 * (b[0] + b[2]))
      return false;
  }
  return true;
}

}   // namespace slender
