#include "slender_sim/dynamics/fast_projection.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "slender_sim/geometry/rotation.h"

namespace slender {

namespace {

constexpr int kHalo = ChainArrays::kHalo;

}   // namespace

void FastProjection::put(double* const* p, int i, const Eigen::Vector3d& v)
{
  for (int k = 0; k < 3; ++k)
    p[k][i] = v[k];
}

int FastProjection::addChain(const Eigen::VectorXd& rest_length, const Eigen::VectorXd& mass, bool closed)
{
  const int n = static_cast<int>(mass.size()), edges = static_cast<int>(rest_length.size());
  if (edges < (closed ? 3 : 1) || edges != (closed ? n : n - 1) || !(rest_length.minCoeff() > 0) ||
      !(mass.minCoeff() > 0))
    throw std::invalid_argument(
        "a chain of " + std::to_string(n) + " nodes and " + std::to_string(edges) +
        " edges: needs one edge fewer than nodes (closed: as many, 3 at least), and positive lengths and masses");
  Chain chain;
  ChainArrays& a = chain.a;
  a.nodes = n;
  a.edges = edges;
  a.closed = closed;
  chain.storage.reserve(24);
  const auto allocate = [&](double*& p, double fill) {
    chain.storage.emplace_back(n + 2 * kHalo, fill);
    p = chain.storage.back().data() + kHalo;
  };
  for (int k = 0; k < 3; ++k)
    for (double** p : {&a.x[k], &a.direction[k], &a.s[k]})
      allocate(*p, 0.0);
  for (double** p :
       {&a.inverse_mass, &a.active, &a.c, &a.diagonal, &a.upper, &a.lower, &a.pivot, &a.factor, &a.lambda, &a.total})
    allocate(*p, 0.0);
  for (double** p : {&a.rest_length, &a.inverse_rest})
    allocate(*p, 1.0);
  for (int j = 0; j < edges; ++j)
  {
    a.rest_length[j] = rest_length[j];
    a.inverse_rest[j] = 1.0 / rest_length[j];
  }
  chain.mass.assign(mass.data(), mass.data() + n);
  chain.owner.assign(n, kFree);
  chain.r_B.assign(n, Eigen::Vector3d::Zero());
  chain.start.assign(n, Eigen::Vector3d::Zero());
  chain.trial = chain.start;
  if (closed)
    chain.corner.assign(edges, 0.0);
  chains_.push_back(std::move(chain));
  prepared_ = false;
  return static_cast<int>(chains_.size()) - 1;
}

void FastProjection::setOwner(int chain, int node, int owner)
{
  prepared_ = prepared_ && chains_[chain].owner[node] == owner;
  chains_[chain].owner[node] = owner;
}

void FastProjection::releaseAll(int chain)
{
  std::fill(chains_[chain].owner.begin(), chains_[chain].owner.end(), kFree);
  prepared_ = false;
}

void FastProjection::weld(int chain, int node, int body, const Eigen::Vector3d& r_B)
{
  if (body < 0 || body >= static_cast<int>(bodies_.size()))
    throw std::invalid_argument("node " + std::to_string(node) + " is welded to body " + std::to_string(body) +
                                "; there are " + std::to_string(bodies_.size()));
  setOwner(chain, node, body);
  chains_[chain].r_B[node] = r_B;
}

void FastProjection::setStart(int chain, const Eigen::Matrix3Xd& x)
{
  for (int i = 0; i < chains_[chain].a.nodes; ++i)
    chains_[chain].start[i] = x.col(i);
}

void FastProjection::setTrial(int chain, const Eigen::Matrix3Xd& x)
{
  for (int i = 0; i < chains_[chain].a.nodes; ++i)
    chains_[chain].trial[i] = x.col(i);
}

/// Inverse masses, and which edges can be moved by nodes, by bodies or not at all.
void FastProjection::prepare()
{
  touches_.clear();
  specials_.clear();
  int run = 0;
  std::size_t longest = 0;
  for (int c = 0; c < static_cast<int>(chains_.size()); ++c)
  {
    Chain& chain = chains_[c];
    const ChainArrays& a = chain.a;
    const int n = a.nodes;
    longest = std::max<std::size_t>(longest, n);
    for (int i = 0; i < n; ++i)
      a.inverse_mass[i] = chain.owner[i] == kFree ? 1.0 / chain.mass[i] : 0.0;
    for (int i = 0; i < kHalo; ++i)
      a.inverse_mass[n + i] = a.closed ? a.inverse_mass[i % n] : 0.0;
    const int first_run = ++run;
    int start = kFree;   // owner of the last node before that is not free; free: there is none
    for (int i = 0; i < n && a.closed; ++i)
      start = chain.owner[i] != kFree ? chain.owner[i] : start;
    for (int j = 0; j < a.edges; ++j)
    {
      const int tail = j, head = (j + 1) % n, from = chain.owner[tail], to = chain.owner[head];
      if (from != kFree)
      {
        ++run;
        start = from;
      }
      const bool can_move = from == kFree || to == kFree || from != to;
      const bool by_bodies = can_move && from != kFree && to != kFree;
      const bool closes = from == kFree && to != kFree && start != kFree && std::max(start, to) >= 0;
      a.active[j] = can_move && !by_bodies && !closes;
      a.lambda[j] = a.total[j] = 0.0;
      const int number = by_bodies || closes ? static_cast<int>(specials_.size()) : -1;
      if (number >= 0)
        specials_.push_back({c, j, run, closes ? (j > 0 ? j : a.edges) - 1 : -1});
      if (can_move && from >= 0)
        touches_.push_back({c, j, from, -1.0, tail, number, run, Vector6::Zero(), Vector6::Zero()});
      if (can_move && to >= 0)
        touches_.push_back({c, j, to, 1.0, head, number, run, Vector6::Zero(), Vector6::Zero()});
    }
    if (a.closed && chain.owner[0] == kFree)   // the last run goes on in the first
    {
      for (Touch& t : touches_)
        if (t.chain == c && t.run == run)
          t.run = first_run;
      for (Special& s : specials_)
        if (s.chain == c && s.run == run)
          s.run = first_run;
    }
  }
  solution_.resize(6 * bodies_.size() + specials_.size());
  if (!touches_.empty())
    buildPattern();
  impulse_.resize(bodies_.size());
  turn_.resize(bodies_.size());
  column_.assign(longest, 0.0);
  prepared_ = true;
}

/// A closed chain's corners are a rank-one change [Press et al., Numerical Recipes, 2.7.2].
void FastProjection::factorChain(Chain& chain)
{
  const ChainArrays& a = chain.a;
  const ChainKernels& kernels = chainKernels();
  const int last = a.edges - 1;
  chain.corner_row = 0.0;
  const double up = a.closed ? a.lower[0] : 0.0, down = a.closed ? a.upper[last] : 0.0;
  if (up == 0.0 || down == 0.0)
  {
    kernels.factor(a);
    return;
  }
  const double gamma = -a.diagonal[0];
  a.diagonal[0] -= gamma;
  a.diagonal[last] -= up * down / gamma;
  kernels.factor(a);
  std::fill(chain.corner.begin(), chain.corner.end(), 0.0);
  chain.corner[0] = gamma;
  chain.corner[last] = down;
  kernels.solve(a, chain.corner.data());
  chain.corner_row = up / gamma;
  chain.corner_factor = 1.0 / (1.0 + chain.corner[0] + chain.corner_row * chain.corner[last]);
}

void FastProjection::solveChain(const Chain& chain, double* b) const
{
  const int last = chain.a.edges - 1;
  chainKernels().solve(chain.a, b);
  if (chain.corner_row == 0.0)
    return;
  const double f = (b[0] + chain.corner_row * b[last]) * chain.corner_factor;
  for (int j = 0; j <= last; ++j)
    b[j] -= f * chain.corner[j];
}

/// Constraints and their system at the present positions. Returns the largest error.
double FastProjection::evaluate()
{
  double worst = 0.0;
  for (Chain& chain : chains_)
  {
    const double error = chainKernels().constraints(chain.a);
    if (!(error <= worst))
      worst = error;
    if (std::isnan(worst))
      return worst;
  }
  for (Special& special : specials_)
  {
    const ChainArrays& a = chains_[special.chain].a;
    const int j = special.edge;
    const Eigen::Vector3d s = at(a.s, j);
    special.c = 0.5 * (s.squaredNorm() - 1.0) * a.rest_length[j];
    const double error = std::abs(s.squaredNorm() - 1.0);
    if (!(error <= worst))
      worst = error;
    if (special.before < 0)
      continue;
    special.to_before = std::exchange(a.upper[special.before], 0.0);
    special.from_before = std::exchange(a.lower[j], 0.0);
    special.own = a.inverse_mass[j] * s.dot(at(a.direction, j));
    a.diagonal[j] = 1.0;
  }
  return worst;
}

ProjectionReport FastProjection::project(double h)
{
  step_ = h;
  if (!prepared_)
    prepare();
  ProjectionReport report;
  const ChainKernels& kernels = chainKernels();
  for (Chain& chain : chains_)
  {
    for (int i = 0; i < chain.a.nodes; ++i)
      put(chain.a.x, i, chain.owner[i] >= 0 ? bodies_[chain.owner[i]].start * chain.r_B[i] : chain.start[i]);
    kernels.takeDirections(chain.a);
    for (int i = 0; i < chain.a.nodes; ++i)
      put(chain.a.x, i, chain.owner[i] >= 0 ? bodies_[chain.owner[i]].pose * chain.r_B[i] : chain.trial[i]);
    std::fill_n(chain.a.total, chain.a.edges, 0.0);
  }
  for (std::size_t b = 0; b < bodies_.size(); ++b)
  {
    ProjectedBody& body = bodies_[b];
    turn_[b] = rotationVector(body.pose.orientation * body.start.orientation.conjugate());
    impulse_[b].setZero();
    // angular momentum for now
    body.velocity.angular =
        body.pose.orientation * (body.inertia * (body.pose.orientation.conjugate() * body.velocity.angular));
  }

  const auto bodiesDone = [&] {
    for (std::size_t b = 0; b < bodies_.size(); ++b)
    {
      ProjectedBody& body = bodies_[b];
      body.velocity.linear += impulse_[b].head<3>() / (body.mass * h);
      body.velocity.angular += impulse_[b].tail<3>() / h;
      body.velocity.angular = body.pose.orientation *
                              (body.inertia.inverse() * (body.pose.orientation.conjugate() * body.velocity.angular));
    }
  };
  for (;;)
  {
    report.constraint_error = evaluate();
    if (report.constraint_error <= tolerance)
    {
      bodiesDone();
      return report;
    }
    if (!std::isfinite(report.constraint_error) || report.iterations >= max_iterations)
      break;
    ++report.iterations;
    for (Chain& chain : chains_)
      factorChain(chain);
    if (!touches_.empty())
    {
      linearise();
      if (!solveBodies())
        break;
    }
    for (Chain& chain : chains_)
    {
      std::copy_n(chain.a.c, chain.a.edges, chain.a.lambda);
      solveChain(chain, chain.a.lambda);
    }
    for (std::size_t k = 0; k < specials_.size(); ++k)
      chains_[specials_[k].chain].a.lambda[specials_[k].edge] = solution_[6 * bodies_.size() + k];
    for (Chain& chain : chains_)
      kernels.apply(chain.a);
    if (!bodies_.empty())
      moveBodies();
  }
  report.ok = false;
  findOverstretched(report);
  return report;
}

/// Two held nodes with only free ones between them, further apart than the edges between them are long.
bool FastProjection::findOverstretched(ProjectionReport& report) const
{
  for (int c = 0; c < static_cast<int>(chains_.size()); ++c)
  {
    const Chain& chain = chains_[c];
    const int n = chain.a.nodes;
    int held = -1;
    double length = 0.0;
    for (int i = 0; i < (chain.a.closed ? 2 * n : n); ++i)
    {
      const int owner = chain.owner[i % n];
      if (owner == kHeld && held >= 0 && i - held > 1 &&
          (chain.trial[i % n] - chain.trial[held % n]).norm() > length * (1 - 1e-9))
      {
        report.chain = c;
        report.first_node = held % n;
        report.last_node = i % n;
        return true;
      }
      if (owner != kFree)
      {
        held = owner == kHeld ? i : -1;
        length = 0.0;
      }
      length += i % n < chain.a.edges ? chain.a.rest_length[i % n] : 0.0;
    }
  }
  return false;
}

void FastProjection::correct(int c, Eigen::Matrix3Xd& x, Eigen::Matrix3Xd& v) const
{
  const Chain& chain = chains_[c];
  for (int i = 0; i < chain.a.nodes; ++i)
  {
    const int owner = chain.owner[i];
    if (owner == kHeld)
      continue;
    x.col(i) = at(chain.a.x, i);
    if (owner == kFree)
      v.col(i) += (x.col(i) - chain.trial[i]) / step_;
    else
    {
      const ProjectedBody& body = bodies_[owner];
      v.col(i) = body.velocity.linear + body.velocity.angular.cross(body.pose.orientation * chain.r_B[i]);
    }
  }
}

Eigen::Vector3d FastProjection::force(int c, int node) const
{
  const ChainArrays& a = chains_[c].a;
  const int before = node > 0 ? node - 1 : a.closed ? a.edges - 1 : -1;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  if (node < a.edges)
    sum += a.total[node] * at(a.direction, node);
  if (before >= 0)
    sum -= a.total[before] * at(a.direction, before);
  return sum / (step_ * step_);
}

}   // namespace slender
