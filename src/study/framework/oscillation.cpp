#include "slender_sim/study/oscillation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <Eigen/Dense>

namespace slender::study {
namespace {

/// Columns 1, cos, sin, cos, sin at every `stride`-th sample; time zero in the middle.
Eigen::MatrixXd tones(const Eigen::Vector2d& omega, Eigen::Index samples, double interval, Eigen::Index stride)
{
  Eigen::MatrixXd basis((samples + stride - 1) / stride, 5);
  for (Eigen::Index k = 0; k < basis.rows(); ++k)
  {
    const double t = interval * static_cast<double>(k * stride - samples / 2);
    basis.row(k) << 1, std::cos(omega[0] * t), std::sin(omega[0] * t), std::cos(omega[1] * t), std::sin(omega[1] * t);
  }
  return basis;
}

/// The best of a grid of frequencies about the mean one, which the zero crossings give; spaced finely enough for
/// Gauss-Newton.
Eigen::Vector2d scan(const std::vector<Eigen::VectorXd>& signals, double interval)
{
  const Eigen::Index samples = signals.front().size();
  const double duration = interval * static_cast<double>(samples);
  int crossings = 0;
  for (const Eigen::VectorXd& q : signals)
    for (Eigen::Index k = 1; k < samples; ++k)
      crossings += (q[k - 1] < 0) != (q[k] < 0);
  const double mean = M_PI * crossings / static_cast<double>(signals.size()) / duration;
  if (mean * duration < 8 * M_PI)
    throw std::runtime_error("two tones: fewer than four periods");
  const Eigen::Index stride = std::max<Eigen::Index>(1, static_cast<Eigen::Index>(2 * M_PI / mean / 8 / interval));
  const double step = 0.25 * 2 * M_PI / duration;
  Eigen::Vector2d best(mean, mean);
  double least = std::numeric_limits<double>::infinity();
  for (int shift = -12; shift <= 12; ++shift)
    for (int split = 1; split <= 40; ++split)
    {
      const Eigen::Vector2d omega(mean + step * (shift - 0.5 * split), mean + step * (shift + 0.5 * split));
      const Eigen::MatrixXd basis = tones(omega, samples, interval, stride);
      const Eigen::LDLT<Eigen::MatrixXd> normal(basis.transpose() * basis);
      double misfit = 0;
      for (const Eigen::VectorXd& q : signals)
      {
        const Eigen::VectorXd thin = Eigen::Map<const Eigen::VectorXd, 0, Eigen::InnerStride<>>(
            q.data(), basis.rows(), Eigen::InnerStride<>(stride));
        misfit += (thin - basis * normal.solve(basis.transpose() * thin)).squaredNorm();
      }
      if (misfit < least)
      {
        least = misfit;
        best = omega;
      }
    }
  return best;
}

}   // namespace

TwoTones fitTwoTones(const std::vector<std::vector<double>>& signals, double interval)
{
  std::vector<Eigen::VectorXd> q;
  for (const std::vector<double>& s : signals)
  {
    Eigen::VectorXd v = Eigen::Map<const Eigen::VectorXd>(s.data(), static_cast<Eigen::Index>(s.size()));
    v.array() -= v.mean();
    const double spread = std::sqrt(v.squaredNorm() / static_cast<double>(v.size()));
    if (!(spread > 0) || v.size() < 16)
      throw std::runtime_error("two tones: a signal is constant or too short");
    q.push_back(v / spread);
  }
  Eigen::Vector2d omega = scan(q, interval);

  // Gauss-Newton on the two frequencies, amplitudes and constants together
  const Eigen::Index samples = q.front().size();
  const int count = static_cast<int>(q.size());
  double misfit = 0;
  for (int round = 0; round < 30; ++round)
  {
    const Eigen::MatrixXd basis = tones(omega, samples, interval, 1);
    const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> fit(basis);
    Eigen::MatrixXd slopes(samples * count, 2);   // by the frequencies, less what amplitudes can follow
    Eigen::VectorXd rest(samples * count);
    for (int s = 0; s < count; ++s)
    {
      const Eigen::VectorXd amplitudes = fit.solve(q[s]);
      rest.segment(s * samples, samples) = q[s] - basis * amplitudes;
      Eigen::MatrixXd by(samples, 2);
      for (Eigen::Index k = 0; k < samples; ++k)
      {
        const double t = interval * static_cast<double>(k - samples / 2);
        for (int m : {0, 1})
          by(k, m) = t * (amplitudes[2 + 2 * m] * basis(k, 1 + 2 * m) - amplitudes[1 + 2 * m] * basis(k, 2 + 2 * m));
      }
      slopes.middleRows(s * samples, samples) = by - basis * fit.solve(by);
    }
    misfit = std::sqrt(rest.squaredNorm() / static_cast<double>(rest.size()));
    const Eigen::Vector2d change = slopes.colPivHouseholderQr().solve(rest);
    if (!change.allFinite())
      break;
    omega += change;
    if (change.norm() < 1e-10 * omega.norm())
      break;
  }
  std::sort(omega.data(), omega.data() + 2);
  return {omega[0] / (2 * M_PI), omega[1] / (2 * M_PI), misfit};
}

}   // namespace slender::study
