#include "coupling_matrix.h"

namespace slender {

void CouplingMatrix::begin(int unknowns)
{
  unknowns_ = unknowns;
  solution_.assign(unknowns_, 0.0);
  if (static_cast<int>(columns_.size()) < unknowns_)
    columns_.resize(unknowns_);
  for (int u = 0; u < unknowns_; ++u)
    columns_[u].clear();
}

void CouplingMatrix::notePairs(const Columns& a, const Columns& b)
{
  for (int i = 0; i < a.count; ++i)
    for (int j = 0; j < b.count; ++j)
      note(a.index[i], b.index[j]);
}

void CouplingMatrix::noteBases(const Bases& bases)
{
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j <= i; ++j)
      if (bases[i] >= 0 && bases[j] >= 0)
        for (int r = 0; r < 3; ++r)
          for (int c = 0; c < 3; ++c)
            note(bases[i] + r, bases[j] + c);
}

void CouplingMatrix::finish()
{
  std::vector<int> starts{0}, rows;
  for (int u = 0; u < unknowns_; ++u)
  {
    std::vector<int>& column = columns_[u];
    std::sort(column.begin(), column.end());
    rows.insert(rows.end(), column.begin(), std::unique(column.begin(), column.end()));
    starts.push_back(static_cast<int>(rows.size()));
  }
  if (unknowns_ > 0)
    matrix_.setPattern(unknowns_, std::move(starts), std::move(rows));
}

void CouplingMatrix::addPair(const Columns& a, const Columns& b, double value)
{
  for (int i = 0; i < a.count; ++i)
    for (int j = 0; j < b.count; ++j)
      add(a.index[i], b.index[j], (a.index[i] == b.index[j] ? 2.0 : 1.0) * a.value[i] * b.value[j] * value);
}

void CouplingMatrix::addSquare(const Columns& a, double value)
{
  for (int i = 0; i < a.count; ++i)
    for (int j = 0; j <= i; ++j)
      add(a.index[i], a.index[j], (i != j && a.index[i] == a.index[j] ? 2.0 : 1.0) * a.value[i] * a.value[j] * value);
}

/// block(i, j), 3 x 3, for the points i and j. A point's three rows follow each other.
template <class Block>
void CouplingMatrix::addBlocks(const Bases& bases, Block&& block)
{
  double* values = matrix_.values();
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j)
      if (bases[i] >= bases[j] && bases[j] >= 0)
      {
        const Eigen::Matrix3d b = block(i, j);
        for (int c = 0; c < 3; ++c)
        {
          const int first = i == j ? c : 0, at = matrix_.index(bases[i] + first, bases[j] + c);
          for (int r = first; r < 3; ++r)
            values[at + r - first] += b(r, c);
        }
      }
}

void CouplingMatrix::addTerm(const ContactTerm& term, const Bases& bases, bool whole)
{
  const Eigen::Matrix3d stiffness = whole ? Eigen::Matrix3d(term.stiffness + term.geometric) : term.stiffness;
  addBlocks(bases, [&](int i, int j) { return Eigen::Matrix3d(term.weight[i] * term.weight[j] * stiffness); });
}

void CouplingMatrix::addRow(const ContactRow& row, const Bases& bases, bool whole)
{
  Eigen::Vector3d r[4];
  for (int k = 0; k < 4; ++k)
    r[k] = row.along[k] * row.normal + (whole ? row.across[k] : 0.0) * row.turning;
  addBlocks(bases, [&](int i, int j) { return Eigen::Matrix3d(row.stiffness * r[i] * r[j].transpose()); });
}

}   // namespace slender
