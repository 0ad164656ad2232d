#include "slender_sim/dynamics/fast_projection.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "slender_sim/geometry/rotation.h"

namespace slender {

namespace {

constexpr int kHalo = ChainArrays::kHalo;

Eigen::Vector3d at(double* const* p, int i) { return {p[0][i], p[1][i], p[2][i]}; }
void put(double* const* p, int i, const Eigen::Vector3d& v)
{
  for (int k = 0; k < 3; ++k)
    p[k][i] = v[k];
}

}  // namespace

int FastProjection::addChain(const Eigen::VectorXd& rest_length, const Eigen::VectorXd& mass, bool closed)
{
  const int n = static_cast<int>(mass.size()), edges = static_cast<int>(rest_length.size());
  if (edges < (closed ? 3 : 1) || edges != (closed ? n : n - 1) || !(rest_length.minCoeff() > 0) || !(mass.minCoeff() > 0))
    throw std::invalid_argument("a chain of " + std::to_string(n) + " nodes and " + std::to_string(edges) +
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
  for (double** p : {&a.inverse_mass, &a.active, &a.c, &a.diagonal, &a.upper, &a.lower, &a.pivot, &a.factor, &a.lambda, &a.total})
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
    throw std::invalid_argument("node " + std::to_string(node) + " is welded to body " + std::to_string(body) + "; there are " + std::to_string(bodies_.size()));
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
  specials_ = 0;
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
    for (int j = 0; j < a.edges; ++j)
    {
      if (chain.owner[j] != kFree)
        ++run;
      const int tail = j, head = (j + 1) % n, from = chain.owner[tail], to = chain.owner[head];
      const bool can_move = from == kFree || to == kFree || from != to;
      const bool special = can_move && from != kFree && to != kFree;
      a.active[j] = can_move && !special;
      a.lambda[j] = a.total[j] = 0.0;
      const int number = special ? specials_++ : -1;
      if (can_move && from >= 0)
        touches_.push_back({c, j, from, -1.0, tail, number, run, Vector6::Zero(), Vector6::Zero()});
      if (can_move && to >= 0)
        touches_.push_back({c, j, to, 1.0, head, number, run, Vector6::Zero(), Vector6::Zero()});
    }
    if (a.closed && chain.owner[0] == kFree)   // the last run goes on in the first
      for (Touch& t : touches_)
        if (t.chain == c && t.run == run)
          t.run = first_run;
  }
  solution_.resize(6 * bodies_.size() + specials_);
  if (!touches_.empty())
    buildPattern();
  impulse_.resize(bodies_.size());
  turn_.resize(bodies_.size());
  column_.assign(longest, 0.0);
  prepared_ = true;
}

/// Bodies whose touches lie in one run are coupled; touches are sorted by chain, so by run, too, but for closed chains.
void FastProjection::buildPattern()
{
  const int bodies = static_cast<int>(bodies_.size()), size = 6 * bodies + specials_;
  std::vector<std::vector<int>> blocks(bodies);   // per body, those that it is coupled to
  std::vector<std::vector<int>> of_special(specials_);
  for (int b = 0; b < bodies; ++b)
    blocks[b].push_back(b);
  for (std::size_t p = 0; p < touches_.size(); ++p)
  {
    if (touches_[p].special >= 0)
    {
      of_special[touches_[p].special].push_back(touches_[p].body);
      continue;
    }
    for (std::size_t q = 0; q < touches_.size(); ++q)
      if (touches_[q].special < 0 && touches_[q].chain == touches_[p].chain && touches_[q].run == touches_[p].run)
        blocks[touches_[p].body].push_back(touches_[q].body);
  }
  std::vector<std::vector<int>> columns(size);
  for (int b = 0; b < bodies; ++b)
  {
    std::sort(blocks[b].begin(), blocks[b].end());
    blocks[b].erase(std::unique(blocks[b].begin(), blocks[b].end()), blocks[b].end());
    for (int other : blocks[b])
      for (int k = 0; k < 6; ++k)
        for (int c = 0; c < 6; ++c)
          columns[6 * b + c].push_back(6 * other + k);
  }
  for (int s = 0; s < specials_; ++s)
  {
    auto& own = of_special[s];
    std::sort(own.begin(), own.end());
    own.erase(std::unique(own.begin(), own.end()), own.end());
    for (int b : own)
      for (int k = 0; k < 6; ++k)
      {
        columns[6 * b + k].push_back(6 * bodies + s);
        columns[6 * bodies + s].push_back(6 * b + k);
      }
  }
  std::vector<int> starts{0}, rows;
  for (const auto& column : columns)
  {
    rows.insert(rows.end(), column.begin(), column.end());
    starts.push_back(static_cast<int>(rows.size()));
  }
  matrix_.setPattern(size, std::move(starts), std::move(rows));
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
  for (const Touch& t : touches_)
    if (t.special >= 0)
    {
      const double error = std::abs(at(chains_[t.chain].a.s, t.edge).squaredNorm() - 1.0);
      if (!(error <= worst))
        worst = error;
    }
  return worst;
}

void FastProjection::linearise()
{
  for (Touch& t : touches_)
  {
    const Chain& chain = chains_[t.chain];
    const ProjectedBody& body = bodies_[t.body];
    const Eigen::Vector3d s = at(chain.a.s, t.edge), d = at(chain.a.direction, t.edge);
    const Eigen::Vector3d arm = body.pose.orientation * chain.r_B[t.node], start_arm = body.start.orientation * chain.r_B[t.node];
    t.row << t.sign * s, t.sign * (rotationRate(turn_[t.body]).transpose() * arm.cross(s));
    t.column << -t.sign * d, -t.sign * start_arm.cross(d);
  }
}

/// The bodies' displacements y: with T the chains' systems, A and B the touches' rows and columns, M the bodies' inertia,
/// T lambda = c + A y and M y = B lambda. Adds A y to the right-hand sides. Edges that only bodies move keep their multipliers as unknowns.
bool FastProjection::solveBodies()
{
  const int bodies = static_cast<int>(bodies_.size()), first_special = 6 * bodies;
  std::vector<double>& values = matrix_.values();
  std::fill(values.begin(), values.end(), 0.0);
  solution_.setZero();
  for (int b = 0; b < bodies; ++b)
  {
    const Eigen::Matrix3d r = bodies_[b].start.orientation.toRotationMatrix(), inertia = r * bodies_[b].inertia * r.transpose();
    for (int k = 0; k < 3; ++k)
    {
      entry(6 * b + k, 6 * b + k) = bodies_[b].mass;
      for (int l = 0; l < 3; ++l)
        entry(6 * b + 3 + k, 6 * b + 3 + l) = inertia(k, l);
    }
  }
  for (std::size_t begin = 0; begin < touches_.size();)
  {
    std::size_t end = begin;
    while (end < touches_.size() && touches_[end].chain == touches_[begin].chain)
      ++end;
    const Chain& chain = chains_[touches_[begin].chain];
    std::copy_n(chain.a.c, chain.a.edges, column_.data());
    solveChain(chain, column_.data());
    for (std::size_t q = begin; q < end; ++q)
      if (touches_[q].special < 0)
        solution_.segment<6>(6 * touches_[q].body) += touches_[q].column * column_[touches_[q].edge];
    for (std::size_t p = begin; p < end; ++p)
    {
      const Touch& t = touches_[p];
      if (t.special >= 0)
      {
        const int row = first_special + t.special;
        for (int k = 0; k < 6; ++k)
        {
          entry(row, 6 * t.body + k) -= t.row[k];
          entry(6 * t.body + k, row) -= t.column[k];
        }
        solution_[row] = 0.5 * (at(chain.a.s, t.edge).squaredNorm() - 1.0) * chain.a.rest_length[t.edge];
        continue;
      }
      std::fill_n(column_.data(), chain.a.edges, 0.0);
      column_[t.edge] = 1.0;
      solveChain(chain, column_.data());
      for (std::size_t q = begin; q < end; ++q)
        if (touches_[q].special < 0 && touches_[q].run == t.run)
          for (int l = 0; l < 6; ++l)
          {
            double* block = &entry(6 * touches_[q].body, 6 * t.body + l);   // six rows follow one another
            for (int k = 0; k < 6; ++k)
              block[k] -= column_[touches_[q].edge] * touches_[q].column[k] * t.row[l];
          }
    }
    begin = end;
  }
  if (!matrix_.factor())
    return false;
  matrix_.solve(solution_.data());
  if (!solution_.allFinite())
    return false;
  for (const Touch& t : touches_)
  {
    const ChainArrays& a = chains_[t.chain].a;
    if (t.special < 0)
      a.c[t.edge] += t.row.dot(solution_.segment<6>(6 * t.body));
  }
  return true;
}

/// Bodies, and the nodes welded to them, by their impulses so far.
void FastProjection::moveBodies()
{
  for (const Touch& t : touches_)
  {
    const double lambda = chains_[t.chain].a.lambda[t.edge];
    const Vector6 by = lambda * t.column;
    ProjectedBody& body = bodies_[t.body];
    impulse_[t.body] += by;
    body.pose.position += by.head<3>() / body.mass;
    const Eigen::Quaterniond& q = body.start.orientation;
    turn_[t.body] += q * (body.inertia.inverse() * (q.conjugate() * Eigen::Vector3d(by.tail<3>())));
  }
  for (std::size_t b = 0; b < bodies_.size(); ++b)
    bodies_[b].pose.orientation = (fromRotationVector(turn_[b]) * bodies_[b].start.orientation).normalized();
  for (Chain& chain : chains_)
    for (int i = 0; i < chain.a.nodes; ++i)
      if (chain.owner[i] >= 0)
        put(chain.a.x, i, bodies_[chain.owner[i]].pose * chain.r_B[i]);
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
    body.velocity.angular = body.pose.orientation * (body.inertia * (body.pose.orientation.conjugate() * body.velocity.angular));
  }

  const auto bodiesDone = [&] {
    for (std::size_t b = 0; b < bodies_.size(); ++b)
    {
      ProjectedBody& body = bodies_[b];
      body.velocity.linear += impulse_[b].head<3>() / (body.mass * h);
      body.velocity.angular += impulse_[b].tail<3>() / h;
      body.velocity.angular = body.pose.orientation * (body.inertia.inverse() * (body.pose.orientation.conjugate() * body.velocity.angular));
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
    for (const Touch& t : touches_)
      if (t.special >= 0)
        chains_[t.chain].a.lambda[t.edge] = solution_[6 * bodies_.size() + t.special];
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
      if (owner == kHeld && held >= 0 && i - held > 1 && (chain.trial[i % n] - chain.trial[held % n]).norm() > length * (1 - 1e-9))
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

}  // namespace slender
