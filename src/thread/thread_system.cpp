#include "slender_sim/thread/thread_system.h"

#include <limits>

namespace slender {

void ThreadSystem::resize(int nodes)
{
  setSize(nodes, false, Curvature::tangent);   // the thesis's curvature
  if (nodes > capacity())
    allocate(std::max(64, nodes + nodes / 2));
  resizeMatrix();
  const auto clear = [&](double* p, double value) { std::fill(p - kHalo, p + nodes + kHalo, value); };
  for (double* p : {a_.turn,     a_.base_twist, a_.twist,    a_.strain,      a_.stretch,     a_.rest_strain, a_.b11,
                    a_.b12,      a_.b22,        a_.beta,     a_.rest_kappa1, a_.rest_kappa2, a_.rest_twist,  a_.weight,
                    a_.force[0], a_.force[1],   a_.force[2], a_.target[0],   a_.target[1],   a_.target[2]})
    clear(p, 0.0);
  clear(a_.inverse_length, 1.0);
  clear(a_.inverse_rest_length, 1.0);
  std::fill_n(gradient_.begin(), 4 * nodes, 0.0);
  keepTurns(true);
  forgetTurns();
  holds_.release(nodes);
  spin_inertia_.resize(a_.edges);
  has_surface_ = false;
  clearTerms();
  addTerm(spin_inertia_);
  stretch_modulus_ = node_stiffness_ = shift_x_ = shift_theta_ = 0.0;
}

RodEvaluation ThreadSystem::takeRestStrains()
{
  const int edges = a_.edges;
  for (int k = 0; k < 3; ++k)
  {
    std::copy_n(a_.x[k], a_.nodes, x_base_[k].data());
    for (int j = -2; j < edges + 10; ++j)   // the halo continues the end edges
      if (j < 0 || j >= edges)
      {
        a_.base_t[k][j] = a_.base_t[k][std::clamp(j, 0, edges - 1)];
        a_.base_d1[k][j] = a_.base_d1[k][std::clamp(j, 0, edges - 1)];
      }
  }
  const RodEvaluation result = evaluateWhole(false);
  min_rest_length_ = std::numeric_limits<double>::infinity();
  for (int j = 0; j < edges; ++j)
  {
    a_.inverse_rest_length[j] = a_.inverse_length[j];
    min_rest_length_ = std::min(min_rest_length_, 1.0 / a_.inverse_length[j]);
  }
  for (int i = 1; i + 1 < a_.nodes; ++i)
  {
    a_.rest_kappa1[i] = a_.kappa1[i];
    a_.rest_kappa2[i] = a_.kappa2[i];
    a_.rest_twist[i] = a_.base_twist[i] = a_.twist[i];
  }
  return result;
}

int ThreadSystem::sharpestJoint(double& cosine) const
{
  const double beyond = cosine;
  int joint = -1;
  cosine = 0.0;
  for (int i = 1; i + 1 < a_.nodes; ++i)
  {
    const double own = get(a_.t, i - 1).dot(get(a_.t, i));
    if (own < cosine && own > beyond)
    {
      cosine = own;
      joint = i;
    }
  }
  return joint;
}

void ThreadSystem::setEdge(int j, double modulus, double volume)
{
  a_.stretch[j] = modulus;
  if (has_surface_)
    surface_.setVolume(j, volume);
  if (modulus <= stretch_modulus_)
    return;
  stretch_modulus_ = modulus;
  node_stiffness_ = modulus / min_rest_length_;
}

void ThreadSystem::setJoint(int i, double bend, double twist)
{
  a_.b11[i] = a_.b22[i] = bend;
  a_.beta[i] = twist;
  // what a shift adds is measured by the bending, twisting and inertia that are there
  shift_x_ = std::max(shift_x_, 1e-2 * bend / (min_rest_length_ * min_rest_length_));
  shift_theta_ = std::max(shift_theta_, twist);
}

void ThreadSystem::setSurfaceTension(double gamma, SurfaceShape shape)
{
  has_surface_ = gamma != 0.0;
  if (!has_surface_)
    return;
  surface_.begin(gamma, shape, a_.edges);
  addTerm(surface_);
}

}   // namespace slender
