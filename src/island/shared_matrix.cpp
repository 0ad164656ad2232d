#include "island/shared_matrix.h"

#include <iterator>

namespace slender {

void SharedMatrix::begin(int unknowns, int multipliers)
{
  unknowns_ = unknowns;
  multipliers_ = multipliers;
  for (auto* lists : {&columns_, &blocks_below_})
    if (static_cast<int>(lists->size()) < unknowns_)
      lists->resize(unknowns_);
  kept_starts_.assign(static_cast<std::size_t>(unknowns_) + 1, 0);
  kept_rows_.clear();
  beginAgain();
}

void SharedMatrix::beginAgain()
{
  solution_.assign(unknowns_, 0.0);
  for (int u = 0; u < unknowns_; ++u)
  {
    columns_[u].clear();
    blocks_below_[u].clear();
  }
}

void SharedMatrix::keepNoted()
{
  noteBlocks();
  for (int u = 0; u < unknowns_; ++u)
  {
    std::vector<int>& noted = columns_[u];
    std::sort(noted.begin(), noted.end());
    kept_rows_.insert(kept_rows_.end(), noted.begin(), std::unique(noted.begin(), noted.end()));
    kept_starts_[u + 1] = static_cast<int>(kept_rows_.size());
    noted.clear();
  }
}

/// Appends the rows of a column that have been noted and kept, each once and in ascending order.
void SharedMatrix::appendNoted(int column, std::vector<int>& rows)
{
  std::vector<int>& noted = columns_[column];
  const auto kept = kept_rows_.begin() + kept_starts_[column], kept_end = kept_rows_.begin() + kept_starts_[column + 1];
  if (noted.empty())
  {
    rows.insert(rows.end(), kept, kept_end);
    return;
  }
  std::sort(noted.begin(), noted.end());
  std::set_union(kept, kept_end, noted.begin(), std::unique(noted.begin(), noted.end()), std::back_inserter(rows));
}

void SharedMatrix::notePairs(const Columns& a, const Columns& b)
{
  for (int i = 0; i < a.count; ++i)
    for (int j = 0; j < b.count; ++j)
      note(a.index[i], b.index[j]);
}

void SharedMatrix::merge(const Columns* rows, int count, MergedRows& merged)
{
  merged.count = 0;
  for (int r = 0; r < count; ++r)
    for (int i = 0; i < rows[r].count; ++i)
      merged.place(rows[r].index[i])[r] += rows[r].value[i];
}

/// The weights of an unknown, which are zero if it is new.
Eigen::Vector3d& SharedMatrix::MergedRows::place(int wanted)
{
  int at = count;
  while (at > 0 && unknown[at - 1] > wanted)
    --at;
  if (at > 0 && unknown[at - 1] == wanted)
    return weight[at - 1];
  for (int k = count++; k > at; --k)
  {
    unknown[k] = unknown[k - 1];
    weight[k] = weight[k - 1];
  }
  unknown[at] = wanted;
  weight[at].setZero();
  return weight[at];
}

void SharedMatrix::noteRows(const Columns* rows, int count)
{
  MergedRows merged;
  merge(rows, count, merged);
  for (int i = 0; i < merged.count; ++i)
    for (int j = i; j < merged.count; ++j)
      columns_[merged.unknown[i]].push_back(merged.unknown[j]);
}

void SharedMatrix::noteBases(const Bases& bases)
{
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j <= i; ++j)
      if (bases[i] >= 0 && bases[j] >= 0)
        blocks_below_[std::min(bases[i], bases[j])].push_back(std::max(bases[i], bases[j]));
}

/// Notes the entries of the blocks, each block once. Contacts that share points have noted most blocks several times.
void SharedMatrix::noteBlocks()
{
  for (int u = 0; u < unknowns_; ++u)
  {
    std::vector<int>& blocks = blocks_below_[u];
    std::sort(blocks.begin(), blocks.end());
    blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
    for (const int first : blocks)
      for (int c = 0; c < 3; ++c)
        for (int r = first == u ? c : 0; r < 3; ++r)
          columns_[u + c].push_back(first + r);
    blocks.clear();
  }
}

void SharedMatrix::finish(Solver solver, const std::vector<double>& masses)
{
  solver_ = solver;
  cholesky_known_ = false;
  if (unknowns_ == 0)
    return;
  noteBlocks();
  starts_.assign(1, 0);
  rows_.clear();
  for (int u = 0; u < unknowns_; ++u)
  {
    appendNoted(u, rows_);
    starts_.push_back(static_cast<int>(rows_.size()));
  }
  values_.assign(rows_.size(), 0.0);
  idle_.assign(static_cast<std::size_t>(unknowns_), false);
  if (solver_ != Solver::sweeps)
    return;
  if (!sweeps_)
    sweeps_ = std::make_unique<PointSweeps>();
  sweeps_->setPattern(starts_, rows_, masses);
}

int SharedMatrix::index(int a, int b) const
{
  const int column = std::min(a, b);
  const auto begin = rows_.begin();
  return static_cast<int>(std::lower_bound(begin + starts_[column], begin + starts_[column + 1], std::max(a, b)) -
                          begin);
}

// ---- solutions

bool SharedMatrix::factorPresent() { return solver_ == Solver::cholesky ? factorDirectly() : sweep(); }

bool SharedMatrix::sweep()
{
  constexpr double kTolerance = 1e-4;    // Newton's method then needs as many iterations as with exact solutions.
  constexpr int kMostIterations = 250;   // A factorisation costs about as much as a hundred of them.
  if (unknowns_ == 0 || !swept_.due())
    return factorDirectly();
  direct_ = false;
  const LinearResult result = sweeps_->solve(values_, solution_, kTolerance, kMostIterations);
  iterations_ = result.iterations;
  if (!result.definite)
    return false;
  const bool solved = result.residual <= kTolerance;
  swept_.tried(solved);
  return solved || factorDirectly();
}

bool SharedMatrix::factorDirectly()
{
  direct_ = true;
  if (unknowns_ == 0)
    return true;
  if (!cholesky_known_)
    cholesky_.setPattern(starts_, rows_, multipliers_);
  cholesky_known_ = true;
  return cholesky_.factor(values_, idle_, threads_);
}

void SharedMatrix::solve()
{
  if (unknowns_ == 0)
    return;
  if (!direct_)
  {
    sweeps_->copySolution(solution_.data());
    return;
  }
  iterations_ = 0;
  cholesky_.solve(solution_.data(), threads_);
}

void SharedMatrix::addPair(const Columns& a, const Columns& b, double value)
{
  for (int i = 0; i < a.count; ++i)
    for (int j = 0; j < b.count; ++j)
      add(a.index[i], b.index[j], (a.index[i] == b.index[j] ? 2.0 : 1.0) * a.value[i] * b.value[j] * value);
}

void SharedMatrix::addSquare(const Columns& a, double value)
{
  for (int i = 0; i < a.count; ++i)
    for (int j = 0; j <= i; ++j)
      add(a.index[i], a.index[j], (i != j && a.index[i] == a.index[j] ? 2.0 : 1.0) * a.value[i] * a.value[j] * value);
}

void SharedMatrix::addRows(const Columns* rows, int count, const Eigen::Matrix3d& stiffness)
{
  MergedRows merged;
  merge(rows, count, merged);
  addMerged(merged, stiffness);
}

void SharedMatrix::addMerged(const MergedRows& merged, const Eigen::Matrix3d& stiffness)
{
  const auto& unknown = merged.unknown;
  const auto follows = [&](int k) { return k > 0 && unknown[k] == unknown[k - 1] + 1; };
  std::array<int, Columns::kMost> at;   // of the column's entries; neighbouring entries are mostly neighbours there
  for (int j = 0; j < merged.count; ++j)
  {
    const Eigen::Vector3d force = stiffness * merged.weight[j];
    for (int i = j; i < merged.count; ++i)
    {
      at[i] = i == j       ? diagonal(unknown[j])
              : follows(i) ? at[i - 1] + 1
              : follows(j) ? inNextColumn(at[i], unknown[i], unknown[j] - 1)
                           : index(unknown[i], unknown[j]);
      values_[at[i]] += merged.weight[i].dot(force);
    }
  }
}

/// block(i, j), 3 x 3, for the points i and j. A point's three rows follow each other.
template <class Block>
void SharedMatrix::addBlocks(const Bases& bases, Block&& block)
{
  double* values = values_.data();
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j)
      if (bases[i] >= bases[j] && bases[j] >= 0)
      {
        const Eigen::Matrix3d b = block(i, j);
        for (int c = 0, at = 0; c < 3; ++c)
        {
          const int first = i == j ? c : 0;
          at = i == j  ? diagonal(bases[j] + c)
               : c > 0 ? inNextColumn(at, bases[i], bases[j] + c - 1)
                       : index(bases[i], bases[j]);
          for (int r = first; r < 3; ++r)
            values[at + r - first] += b(r, c);
        }
      }
}

void SharedMatrix::addTerm(const ContactTerm& term, const ContactRow* rows, int count, const Bases& bases, bool whole)
{
  const Eigen::Matrix3d stiffness = whole ? Eigen::Matrix3d(term.stiffness + term.geometric) : term.stiffness;
  Eigen::Vector3d moves[kMostRows][4];
  for (int n = 0; n < count; ++n)
    for (int k = 0; k < 4; ++k)
      moves[n][k] = rows[n].along[k] * rows[n].normal + (whole ? rows[n].across[k] : 0.0) * rows[n].turning;
  addBlocks(bases, [&](int i, int j) {
    Eigen::Matrix3d block = term.block(i, j, stiffness);
    for (int n = 0; n < count; ++n)
      block += rows[n].stiffness * moves[n][i] * moves[n][j].transpose();
    return block;
  });
}

void SharedMatrix::addTurningTerm(const ContactTerm& term, const Bases& bases, const std::array<int, 2>& turns)
{
  MergedRows merged;
  for (int p = 0; p < 4; ++p)
    for (int c = 0; c < 3 && bases[p] >= 0; ++c)
      merged.place(bases[p] + c)[c] += term.weight[p];
  for (int k = 0; k < 2; ++k)
    if (turns[k] >= 0)
      merged.place(turns[k]) += term.turn[k].column;
  addMerged(merged, term.stiffness);
}

}   // namespace slender
