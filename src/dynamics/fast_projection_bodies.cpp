// The bodies of a projection: their part of each Newton step.
#include <algorithm>

#include "slender_sim/dynamics/fast_projection.h"
#include "slender_sim/geometry/rotation.h"

namespace slender {

/// Bodies whose touches lie in one run are coupled; touches are sorted by chain, so by run, too, but for closed chains.
void FastProjection::buildPattern()
{
  const int bodies = static_cast<int>(bodies_.size()), specials = static_cast<int>(specials_.size()),
            size = 6 * bodies + specials;
  std::vector<std::vector<int>> blocks(bodies);   // per body, those that it is coupled to
  std::vector<std::vector<int>> of_special(specials);
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
  for (int s = 0; s < specials; ++s)
    for (const Touch& t : touches_)
      if (specials_[s].before >= 0 && t.special < 0 && t.chain == specials_[s].chain && t.run == specials_[s].run)
        of_special[s].push_back(t.body);
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
  for (int s = 0; s < specials; ++s)
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
    columns[6 * bodies + s].push_back(6 * bodies + s);
  }
  std::vector<int> starts{0}, rows;
  for (const auto& column : columns)
  {
    rows.insert(rows.end(), column.begin(), column.end());
    starts.push_back(static_cast<int>(rows.size()));
  }
  matrix_.setPattern(size, std::move(starts), std::move(rows), 6 * bodies);
}

void FastProjection::linearise()
{
  for (Touch& t : touches_)
  {
    const Chain& chain = chains_[t.chain];
    const ProjectedBody& body = bodies_[t.body];
    const Eigen::Vector3d s = at(chain.a.s, t.edge), d = at(chain.a.direction, t.edge);
    const Eigen::Vector3d arm = body.pose.orientation * chain.r_B[t.node],
                          start_arm = body.start.orientation * chain.r_B[t.node];
    t.row << t.sign * s, t.sign * (rotationRate(turn_[t.body]).transpose() * arm.cross(s));
    t.column << -t.sign * d, -t.sign * start_arm.cross(d);
  }
}

/// The bodies' displacements y: with T the chains' systems, A and B the touches' rows and columns, M the bodies'
/// inertia, T lambda = c + A y and M y = B lambda. Adds A y to the right-hand sides. Special edges keep their
/// multipliers as unknowns, too.
bool FastProjection::solveBodies()
{
  std::vector<double>& values = matrix_.values();
  std::fill(values.begin(), values.end(), 0.0);
  solution_.setZero();
  addInertias();
  for (OnChain on{0, 0, 0, 0}; on.begin < touches_.size(); on.begin = on.end, on.first = on.last)
  {
    while (on.end < touches_.size() && touches_[on.end].chain == touches_[on.begin].chain)
      ++on.end;
    while (on.last < specials_.size() && specials_[on.last].chain == touches_[on.begin].chain)
      ++on.last;
    addChain(on);
    addSpecials(on);
  }
  if (!matrix_.factor())
    return false;
  matrix_.solve(solution_.data());
  if (!solution_.allFinite())
    return false;
  const int first_special = 6 * static_cast<int>(bodies_.size());
  for (const Touch& t : touches_)
  {
    const ChainArrays& a = chains_[t.chain].a;
    if (t.special < 0)
      a.c[t.edge] += t.row.dot(solution_.segment<6>(6 * t.body));
  }
  for (std::size_t k = 0; k < specials_.size(); ++k)
    if (specials_[k].before >= 0)
      chains_[specials_[k].chain].a.c[specials_[k].before] -= specials_[k].to_before * solution_[first_special + k];
  return true;
}

void FastProjection::addInertias()
{
  for (int b = 0; b < static_cast<int>(bodies_.size()); ++b)
  {
    const Eigen::Matrix3d r = bodies_[b].start.orientation.toRotationMatrix(),
                          inertia = r * bodies_[b].inertia * r.transpose();
    for (int k = 0; k < 3; ++k)
    {
      entry(6 * b + k, 6 * b + k) = bodies_[b].mass;
      for (int l = 0; l < 3; ++l)
        entry(6 * b + 3 + k, 6 * b + 3 + l) = inertia(k, l);
    }
  }
}

/// Right-hand sides of the bodies and special edges of a chain, and what its touches add to the matrix.
void FastProjection::addChain(const OnChain& on)
{
  const int first_special = 6 * static_cast<int>(bodies_.size());
  const Chain& chain = chains_[touches_[on.begin].chain];
  std::copy_n(chain.a.c, chain.a.edges, column_.data());
  solveChain(chain, column_.data());
  for (std::size_t q = on.begin; q < on.end; ++q)
    if (touches_[q].special < 0)
      solution_.segment<6>(6 * touches_[q].body) += touches_[q].column * column_[touches_[q].edge];
  for (std::size_t k = on.first; k < on.last; ++k)
  {
    const Special& s = specials_[k];
    solution_[first_special + k] = s.c - (s.before >= 0 ? s.from_before * column_[s.before] : 0.0);
  }
  for (std::size_t p = on.begin; p < on.end; ++p)
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
      continue;
    }
    std::fill_n(column_.data(), chain.a.edges, 0.0);
    column_[t.edge] = 1.0;
    solveChain(chain, column_.data());
    for (std::size_t q = on.begin; q < on.end; ++q)
      if (touches_[q].special < 0 && touches_[q].run == t.run)
        for (int l = 0; l < 6; ++l)
        {
          double* block = &entry(6 * touches_[q].body, 6 * t.body + l);   // six rows follow one another
          for (int k = 0; k < 6; ++k)
            block[k] -= column_[touches_[q].edge] * touches_[q].column[k] * t.row[l];
        }
    for (std::size_t k = on.first; k < on.last; ++k)
      if (specials_[k].before >= 0 && specials_[k].run == t.run)
        for (int l = 0; l < 6; ++l)
          entry(first_special + static_cast<int>(k), 6 * t.body + l) +=
              specials_[k].from_before * column_[specials_[k].before] * t.row[l];
  }
}

/// What the special edges of a chain add to the matrix.
void FastProjection::addSpecials(const OnChain& on)
{
  const Chain& chain = chains_[touches_[on.begin].chain];
  for (std::size_t k = on.first; k < on.last; ++k)
  {
    const Special& s = specials_[k];
    if (s.before < 0)
      continue;
    const int column = 6 * static_cast<int>(bodies_.size()) + static_cast<int>(k);
    std::fill_n(column_.data(), chain.a.edges, 0.0);
    column_[s.before] = s.to_before;
    solveChain(chain, column_.data());
    entry(column, column) = s.own - s.from_before * column_[s.before];
    for (std::size_t q = on.begin; q < on.end; ++q)
      if (touches_[q].special < 0 && touches_[q].run == s.run)
        for (int l = 0; l < 6; ++l)
          entry(6 * touches_[q].body + l, column) += touches_[q].column[l] * column_[touches_[q].edge];
  }
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

}   // namespace slender
