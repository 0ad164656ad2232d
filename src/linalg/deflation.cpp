#include "linalg/deflation.h"

#include <algorithm>

namespace slender {

namespace {

constexpr int kPointsPerGroup = 49;   // The time to solve hanging sheets differs little between 36 and 64.

/// All neighbours of all points, by points.
void findNeighbours(const std::vector<int>& starts, const std::vector<int>& rows, std::vector<int>& all_starts,
                    std::vector<int>& all)
{
  const int n = static_cast<int>(starts.size()) - 1;
  all_starts.assign(static_cast<std::size_t>(n) + 1, 0);
  for (int j = 0; j < n; ++j)
    for (int k = starts[j]; k < starts[j + 1]; ++k)
    {
      ++all_starts[j + 1];
      ++all_starts[rows[k] + 1];
    }
  for (int j = 0; j < n; ++j)
    all_starts[j + 1] += all_starts[j];
  all.resize(static_cast<std::size_t>(all_starts[n]));
  std::vector<int> next(all_starts.begin(), all_starts.end() - 1);
  for (int j = 0; j < n; ++j)
    for (int k = starts[j]; k < starts[j + 1]; ++k)
    {
      all[next[j]++] = rows[k];
      all[next[rows[k]]++] = j;
    }
}

}   // namespace

/// Each group grows from the first point that has none, by neighbours in the order in which they were reached.
void Deflation::findGroups(const std::vector<int>& starts, const std::vector<int>& neighbours)
{
  const int n = static_cast<int>(starts.size()) - 1;
  group_.assign(n, -1);
  std::vector<int> reached;
  int groups = 0;
  for (int seed = 0; seed < n; ++seed)
  {
    if (group_[seed] >= 0)
      continue;
    group_[seed] = groups;
    reached.assign(1, seed);
    for (std::size_t next = 0; next < reached.size() && static_cast<int>(reached.size()) < kPointsPerGroup; ++next)
      for (int k = starts[reached[next]]; k < starts[reached[next] + 1]; ++k)
        if (group_[neighbours[k]] < 0 && static_cast<int>(reached.size()) < kPointsPerGroup)
        {
          group_[neighbours[k]] = groups;
          reached.push_back(neighbours[k]);
        }
    ++groups;
  }
  motion_.assign(4 * static_cast<std::size_t>(groups), 0.0);
}

void Deflation::setPattern(const std::vector<int>& starts, const std::vector<int>& rows)
{
  const int n = static_cast<int>(starts.size()) - 1;
  std::vector<int> all_starts, all;
  findNeighbours(starts, rows, all_starts, all);
  findGroups(all_starts, all);
  starts_.assign(1, 0);
  columns_.clear();
  own_.resize(n);
  const auto slotOf = [&](int point, int group) {
    return static_cast<int>(std::find(columns_.begin() + starts_[point], columns_.begin() + starts_[point + 1], group) -
                            columns_.begin());
  };
  for (int i = 0; i < n; ++i)
  {
    own_[i] = starts_[i];
    columns_.push_back(group_[i]);
    for (int k = all_starts[i]; k < all_starts[i + 1]; ++k)
      if (std::find(columns_.begin() + starts_[i], columns_.end(), group_[all[k]]) == columns_.end())
        columns_.push_back(group_[all[k]]);
    starts_.push_back(static_cast<int>(columns_.size()));
  }
  blocks_.assign(9 * columns_.size() + 3, 0.0);
  lower_.resize(rows.size());
  upper_.resize(rows.size());
  for (int j = 0; j < n; ++j)
    for (int k = starts[j]; k < starts[j + 1]; ++k)
    {
      lower_[k] = slotOf(rows[k], group_[j]);
      upper_[k] = slotOf(j, group_[rows[k]]);
    }
  setCommonPattern();
}

/// The analysis of the pattern stays if the pattern does.
void Deflation::setCommonPattern()
{
  const std::size_t groups = motion_.size() / 4;
  std::vector<std::vector<int>> below(groups);
  for (std::size_t i = 0; i < group_.size(); ++i)
    for (int k = starts_[i]; k < starts_[i + 1]; ++k)
      if (columns_[k] <= group_[i])
        below[columns_[k]].push_back(group_[i]);
  std::vector<int> starts{0}, rows;
  for (std::vector<int>& column : below)
  {
    std::sort(column.begin(), column.end());
    rows.insert(rows.end(), column.begin(), std::unique(column.begin(), column.end()));
    starts.push_back(static_cast<int>(rows.size()));
  }
  if (starts != common_.starts() || rows != common_.rows())
  {
    common_ = BlockMatrix(std::move(starts), std::move(rows));
    factor_.setPattern(common_);
  }
  in_common_.resize(columns_.size());
  for (std::size_t i = 0; i < group_.size(); ++i)
    for (int k = starts_[i]; k < starts_[i + 1]; ++k)
      in_common_[k] = columns_[k] <= group_[i] ? common_.block(group_[i], columns_[k]) : -1;
}

void Deflation::begin(const std::vector<char>& moves)
{
  moves_ = moves;
  std::fill(blocks_.begin(), blocks_.end(), 0.0);
}

bool Deflation::factor()
{
  common_.setZero();
  still_.assign(motion_.size() / 4, 1);
  for (std::size_t i = 0; i < group_.size(); ++i)
  {
    if (!moves_[i])
      continue;
    still_[group_[i]] = 0;
    for (int k = starts_[i]; k < starts_[i + 1]; ++k)
      if (in_common_[k] >= 0)
        Eigen::Map<Eigen::Matrix3d>(common_.values() + 9 * static_cast<std::size_t>(in_common_[k])) +=
            Eigen::Map<const Eigen::Matrix3d>(blocks_.data() + 9 * static_cast<std::size_t>(k));
  }
  return factor_.factor(common_, still_.data());
}

void Deflation::correct(PointVector& r, PointVector& x)
{
  std::fill(motion_.begin(), motion_.end(), 0.0);
  for (std::size_t i = 0; i < group_.size(); ++i)
    if (moves_[i])
      point(motion_, group_[i]) += point(r, static_cast<Eigen::Index>(i));
  solve(motion_);
  for (std::size_t i = 0; i < group_.size(); ++i)
  {
    const auto p = static_cast<Eigen::Index>(i);
    if (moves_[i])
      point(x, p) += point(motion_, group_[i]);
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
    for (int k = starts_[i]; k < starts_[i + 1]; ++k)
      force += Eigen::Map<const Eigen::Matrix3d>(blocks_.data() + 9 * static_cast<std::size_t>(k)) *
               point(motion_, columns_[k]);
    point(r, p) -= force;
  }
}

}   // namespace slender
