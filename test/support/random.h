#pragma once

#include <random>

#include <Eigen/Geometry>

namespace slender::test {

/// Repeatable random numbers: the same on every run and machine (no std:: distribution, whose output is not specified).
class Random
{
public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double uniform(double low = -1.0, double high = 1.0) { return low + (high - low) * (engine_() * 0x1p-32); }
  Eigen::Vector3d vector(double size = 1.0) { return size * Eigen::Vector3d(uniform(), uniform(), uniform()); }
  Eigen::Vector3d direction()
  {
    for (;;)
    {
      const Eigen::Vector3d v = vector();
      if (v.norm() > 0.1 && v.norm() < 1.0)
        return v.normalized();
    }
  }
  Eigen::Quaterniond rotation() { return Eigen::Quaterniond(Eigen::AngleAxisd(uniform(-3.0, 3.0), direction())); }
  Eigen::VectorXd numbers(int n, double size = 1.0)
  {
    Eigen::VectorXd v(n);
    for (int i = 0; i < n; ++i)
      v[i] = uniform(-size, size);
    return v;
  }

private:
  std::mt19937 engine_;
};

}   // namespace slender::test
