#include "oscillation.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/Dense>

namespace slender::study {
namespace {

/// q_{k+2} + q_{k-2} = b (q_{k+1} + q_{k-1}) + c q_k holds for any two tones, with b = 2 (cos p + cos r), c = -2 - 4 cos p cos r for
/// their phases p, r per lag. A lag of about an eighth of a period keeps it well conditioned.
Eigen::Vector2d prony(const std::vector<Eigen::VectorXd>& signals, double interval)
{
  int crossings = 0;
  const Eigen::VectorXd& first = signals.front();
  for (int k = 1; k < first.size(); ++k)
    crossings += (first[k - 1] < 0) != (first[k] < 0);
  if (crossings < 4)
    throw std::runtime_error("two tones: the signal does not oscillate");
  const int lag = std::max<int>(1, static_cast<int>(2.0 * first.size() / crossings / 8.0));
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  for (const Eigen::VectorXd& q : signals)
    for (int k = 2 * lag; k + 2 * lag < q.size(); ++k)
    {
      const Eigen::Vector2d row(q[k + lag] + q[k - lag], q[k]);
      normal += row * row.transpose();
      right += row * (q[k + 2 * lag] + q[k - 2 * lag]);
    }
  const Eigen::Vector2d bc = normal.ldlt().solve(right);
  const double sum = 0.5 * bc[0], product = -0.25 * (bc[1] + 2), root = std::sqrt(std::max(0.0, 0.25 * sum * sum - product));
  const double c1 = 0.5 * sum + root, c2 = 0.5 * sum - root;
  if (!(std::abs(c1) < 1 && std::abs(c2) < 1))
    throw std::runtime_error("two tones: none found");
  return Eigen::Vector2d(std::acos(c1), std::acos(c2)) / (lag * interval);
}

}  // namespace

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
  Eigen::Vector2d omega = prony(q, interval);

  // Gauss-Newton on the two frequencies, amplitudes and constants together
  const Eigen::Index samples = q.front().size();
  const int count = static_cast<int>(q.size());
  double misfit = 0;
  for (int round = 0; round < 30; ++round)
  {
    Eigen::MatrixXd basis(samples, 5);
    for (Eigen::Index k = 0; k < samples; ++k)
    {
      const double t = interval * static_cast<double>(k - samples / 2);
      basis.row(k) << 1, std::cos(omega[0] * t), std::sin(omega[0] * t), std::cos(omega[1] * t), std::sin(omega[1] * t);
    }
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

}  // namespace slender::study
