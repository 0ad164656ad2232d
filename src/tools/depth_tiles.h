#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include <Eigen/Core>

namespace slender {

/// A picture of numbers of which the largest counts, for example of what is nearest. It knows which of its tiles were
/// drawn on: the others need no clearing, and nobody needs to look at them.
class DepthTiles
{
public:
  static constexpr int kTile = 16;   ///< cells along a side

  DepthTiles(int width, int height, float nothing)
    : width_(width),
      height_(height),
      across_((width + kTile - 1) / kTile),
      nothing_(nothing),
      cells_(static_cast<std::size_t>(width) * height, nothing),
      drawn_(static_cast<std::size_t>(across_) * ((height + kTile - 1) / kTile), 0)
  {
  }

  void clear()
  {
    for (const int tile : list_)
    {
      const int left = tile % across_ * kTile, top = tile / across_ * kTile;
      for (int row = top; row < std::min(top + kTile, height_); ++row)
        std::fill_n(&at(left, row), std::min(kTile, width_ - left), nothing_);
      drawn_[static_cast<std::size_t>(tile)] = 0;
    }
    list_.clear();
  }

  /// Calls span(row, first, end, value, slope) for the cells of columns first..end-1 whose middles lie in a triangle.
  /// Its corners are (column, row, number); `value` is the number at the first of these cells, and grows by `slope`
  /// from column to column.
  template <class Span>
  void fill(const Eigen::Vector3d& p0, const Eigen::Vector3d& p1, const Eigen::Vector3d& p2, const Span& span)
  {
    const Eigen::Vector3d u = p1 - p0, v = p2 - p0;
    const double area = u.x() * v.y() - u.y() * v.x();
    if (!(std::abs(area) > 1e-12))
      return;
    const auto bound = [](double x, int high) {
      return static_cast<int>(std::clamp(x, 0.0, static_cast<double>(high)));
    };
    const int left = bound(std::ceil(std::min({p0.x(), p1.x(), p2.x()}) - 0.5), width_);
    const int right = bound(std::floor(std::max({p0.x(), p1.x(), p2.x()}) - 0.5) + 1, width_);
    const int top = bound(std::ceil(std::min({p0.y(), p1.y(), p2.y()}) - 0.5), height_);
    const int bottom = bound(std::floor(std::max({p0.y(), p1.y(), p2.y()}) - 0.5) + 1, height_);
    if (left >= right || top >= bottom)
      return;
    mark(left, top, right, bottom);
    // shares of the corners, which are not negative inside, change by so much per column
    const double b_step = v.y() / area, c_step = -u.y() / area, a_step = -b_step - c_step;
    const double slope = u.z() * b_step + v.z() * c_step;
    for (int row = top; row < bottom; ++row)
    {
      const double x = left + 0.5 - p0.x(), y = row + 0.5 - p0.y();
      const double b = (x * v.y() - y * v.x()) / area, c = (u.x() * y - u.y() * x) / area;
      double low = 0.0, high = right - left - 1;
      narrow(b, b_step, low, high);
      narrow(c, c_step, low, high);
      narrow(1.0 - b - c, a_step, low, high);
      if (low > high)
        continue;
      const int first = static_cast<int>(std::ceil(low)), end = static_cast<int>(std::floor(high)) + 1;
      if (first < end)
        span(row, left + first, left + end, static_cast<float>(p0.z() + b * u.z() + c * v.z() + first * slope),
             static_cast<float>(slope));
    }
  }

  float& at(int column, int row) { return cells_[static_cast<std::size_t>(row) * width_ + column]; }
  float at(int column, int row) const { return cells_[static_cast<std::size_t>(row) * width_ + column]; }
  int width() const { return width_; }
  int height() const { return height_; }

  /// Tiles that were drawn on, and the columns and rows at which they begin.
  const std::vector<int>& drawn() const { return list_; }
  std::pair<int, int> corner(int tile) const { return {tile % across_ * kTile, tile / across_ * kTile}; }
  /// Whether the tile of a cell was drawn on; a cell outside counts as empty.
  bool isDrawn(int column, int row) const
  {
    return column >= 0 && row >= 0 && column < width_ && row < height_ &&
           drawn_[static_cast<std::size_t>(row / kTile) * across_ + column / kTile];
  }

private:
  /// Of the numbers k from low to high leaves those at which share + k step is not negative.
  static void narrow(double share, double step, double& low, double& high)
  {
    share += 1e-9;   // no cell falls between two triangles
    if (step > 0)
      low = std::max(low, -share / step);
    else if (step < 0)
      high = std::min(high, -share / step);
    else if (share < 0)
      high = -1;
  }

  void mark(int left, int top, int right, int bottom)
  {
    for (int y = top / kTile; y <= (bottom - 1) / kTile; ++y)
      for (int x = left / kTile; x <= (right - 1) / kTile; ++x)
        if (const int tile = y * across_ + x; !drawn_[static_cast<std::size_t>(tile)])
        {
          drawn_[static_cast<std::size_t>(tile)] = 1;
          list_.push_back(tile);
        }
  }

  int width_, height_, across_;
  float nothing_;
  std::vector<float> cells_;
  std::vector<char> drawn_;   // per tile
  std::vector<int> list_;
};

}   // namespace slender
