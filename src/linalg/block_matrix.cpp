#include "slender_sim/linalg/block_matrix.h"

#include <algorithm>
#include <stdexcept>

#include "slender_sim/linalg/point_kernel.h"

namespace slender {

BlockMatrix::BlockMatrix(int points, const std::vector<Eigen::MatrixXi>& elements)
{
  std::vector<std::pair<int, int>> pairs;   // column, row
  for (int i = 0; i < points; ++i)
    pairs.emplace_back(i, i);
  for (const Eigen::MatrixXi& kind : elements)
    for (Eigen::Index e = 0; e < kind.cols(); ++e)
      for (Eigen::Index p = 1; p < kind.rows(); ++p)
        for (Eigen::Index q = 0; q < p; ++q)
          pairs.emplace_back(std::min(kind(p, e), kind(q, e)), std::max(kind(p, e), kind(q, e)));
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  starts_.assign(points + 1, 0);
  for (const auto& [column, row] : pairs)
  {
    ++starts_[column + 1];
    rows_.push_back(row);
  }
  for (int i = 0; i < points; ++i)
    starts_[i + 1] += starts_[i];
  values_.assign(9 * rows_.size() + 4, 0.0);
}

BlockMatrix::BlockMatrix(std::vector<int> starts, std::vector<int> rows)
  : starts_(std::move(starts)),
    rows_(std::move(rows))
{
  values_.assign(9 * rows_.size() + 4, 0.0);
}

int BlockMatrix::block(int a, int b) const
{
  const int column = std::min(a, b), row = std::max(a, b);
  const auto begin = rows_.begin() + starts_[column], end = rows_.begin() + starts_[column + 1];
  const auto at = std::lower_bound(begin, end, row);
  return at == end || *at != row ? -1 : static_cast<int>(at - rows_.begin());
}

std::vector<int> BlockMatrix::slots(const Eigen::MatrixXi& elements) const
{
  std::vector<int> slots;
  slots.reserve(elements.cols() * elements.rows() * (elements.rows() + 1) / 2);
  for (Eigen::Index e = 0; e < elements.cols(); ++e)
    for (Eigen::Index p = 0; p < elements.rows(); ++p)
      for (Eigen::Index q = 0; q <= p; ++q)
      {
        const int found = block(elements(p, e), elements(q, e));
        if (found < 0)
          throw std::invalid_argument("BlockMatrix: points " + std::to_string(elements(p, e)) + " and " +
                                      std::to_string(elements(q, e)) + " are not in the pattern");
        slots.push_back(2 * found + (elements(p, e) < elements(q, e)));
      }
  return slots;
}

void BlockMatrix::setZero() { std::fill(values_.begin(), values_.end(), 0.0); }

std::vector<int> BlockMatrix::mapOf(const PointMatrix& matrix) const
{
  std::vector<int> map;
  map.reserve(matrix.values().size());
  for (int i = 0; i < matrix.size(); ++i)
    for (int k = matrix.starts()[i]; k < matrix.starts()[i + 1]; ++k)
    {
      const int j = matrix.column(k);
      map.push_back(j > i ? -1 : block(i, j));
      if (j <= i && map.back() < 0)
        throw std::invalid_argument("BlockMatrix: points " + std::to_string(i) + " and " + std::to_string(j) +
                                    " are not in the pattern");
    }
  return map;
}

void BlockMatrix::add(double factor, const PointMatrix& matrix, const std::vector<int>& map)
{
  for (std::size_t k = 0; k < map.size(); ++k)
    if (map[k] >= 0)
      for (int c = 0; c < 3; ++c)
        values_[9 * map[k] + 4 * c] += factor * matrix.values()[k];
}

void BlockMatrix::addProduct(const double* x, double* y) const
{
  pointKernels().multiplyBlocks(points(), starts_.data(), rows_.data(), values_.data(), x, y);
}

}   // namespace slender
