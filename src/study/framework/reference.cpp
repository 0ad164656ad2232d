#include "slender_sim/study/reference.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

namespace slender::study {
namespace {

constexpr double kPi = 3.14159265358979323846;

/// Root of a continuous function with a sign change in [low, high], to the last bits.
template <typename F>
double bisect(const F& f, double low, double high)
{
  const bool rising = f(high) > 0.0;
  for (int i = 0; i < 200; ++i)
  {
    const double middle = 0.5 * (low + high);
    if (middle <= low || middle >= high)
      break;
    ((f(middle) > 0.0) == rising ? high : low) = middle;
  }
  return 0.5 * (low + high);
}

/// Simpson's rule over values at an even number of equal intervals.
template <typename F>
double simpson(const std::vector<double>& theta, double h, const F& f)
{
  double sum = f(0) + f(theta.size() - 1);
  for (std::size_t i = 1; i + 1 < theta.size(); ++i)
    sum += (i % 2 ? 4.0 : 2.0) * f(i);
  return sum * h / 3.0;
}

}   // namespace

CantileverTip heavyCantilever(double gamma, double stretch)
{
  // theta_{i-1} - 2 theta_i + theta_{i+1} = h^2/12 (f_{i-1} + 10 f_i + f_{i+1}) inside. At the free end theta' = f = 0,
  // so that theta_{n-1} = theta_n - h^3/6 f'_n + h^4/24 f''_n + O(h^5), f' = gamma cos(theta), f'' = -2 gamma stretch
  // sin cos. 50 points in the boundary layer; round-off grows as n^2, so no more than that
  const int n = 2 * std::clamp(static_cast<int>(25 * std::sqrt(gamma)), 1000, 8000);
  const double h = 1.0 / n;
  const auto f = [&](double s, double t) {
    return -gamma * (1 - s) * std::cos(t) * (1 + stretch * (1 - s) * std::sin(t));
  };
  const auto df = [&](double s, double t) {
    return gamma * (1 - s) * (std::sin(t) - stretch * (1 - s) * std::cos(2 * t));
  };

  std::vector<double> theta(n + 1, 0.0);
  for (int i = 0; i <= n; ++i)   // close to both limits: small load, and boundary layer of width gamma^(-1/2)
  {
    const double s = i * h, small = gamma / 6 * (1 - std::pow(1 - s, 3));
    theta[i] = small < 0.3 ? small : kPi / 2 * (1 - std::exp(-std::min(small, std::sqrt(gamma) * s)));
  }
  theta[0] = 0.0;

  std::vector<double> upper(n + 1), rhs(n + 1);
  for (int iteration = 0; iteration < 100; ++iteration)
  {
    // Rows i = 1..n of the tridiagonal Newton system, eliminated on the way down.
    double largest = 0.0;
    upper[0] = rhs[0] = 0.0;
    for (int i = 1; i <= n; ++i)
    {
      const double s = i * h, t = theta[i];
      double a, b, c, r;
      if (i < n)
      {
        a = 1 - h * h / 12 * df(s - h, theta[i - 1]);
        b = -2 - h * h * 10 / 12 * df(s, t);
        c = 1 - h * h / 12 * df(s + h, theta[i + 1]);
        r = theta[i - 1] - 2 * t + theta[i + 1] -
            h * h / 12 * (f(s - h, theta[i - 1]) + 10 * f(s, t) + f(s + h, theta[i + 1]));
      }
      else
      {
        const double h3 = h * h * h / 6, h4 = h * h * h * h / 24;
        a = 1;
        b = -1 - h3 * gamma * std::sin(t) + h4 * 2 * gamma * stretch * std::cos(2 * t);
        c = 0;
        r = theta[i - 1] - t + h3 * gamma * std::cos(t) + h4 * gamma * stretch * std::sin(2 * t);
      }
      const double pivot = b - a * upper[i - 1];
      upper[i] = c / pivot;
      rhs[i] = (-r - a * rhs[i - 1]) / pivot;
    }
    for (int i = n - 1; i >= 1; --i)
      rhs[i] -= upper[i] * rhs[i + 1];
    for (int i = 1; i <= n; ++i)
      largest = std::max(largest, std::abs(rhs[i]));
    const double scale = std::min(1.0, 0.5 / largest);
    for (int i = 1; i <= n; ++i)
      theta[i] += scale * rhs[i];
    if (largest < 1e-11)
      break;
    if (iteration == 99 || !std::isfinite(largest))
      throw std::runtime_error("reference: heavy cantilever did not converge at gamma = " + std::to_string(gamma));
  }
  const auto length = [&](std::size_t i) { return 1 + stretch * (1 - i * h) * std::sin(theta[i]); };
  return {simpson(theta, h, [&](std::size_t i) { return std::sin(theta[i]) * length(i); }),
          simpson(theta, h, [&](std::size_t i) { return std::cos(theta[i]) * length(i); })};
}

ElasticaShape bucklingElastica(double compression, bool clamped)
{
  const double k = bisect([&](double m) { return 2 - 2 * std::comp_ellint_2(m) / std::comp_ellint_1(m) - compression; },
                          1e-9, 0.9999);
  const double quarter = std::comp_ellint_1(k);
  const double root = (clamped ? 4 : 2) * quarter;
  return {root * root, k / quarter};
}

CantileverTip endLoadedCantilever(double load)
{
  // k^2 = (1 + sin t)/2, sin(phi0) = 1/(k sqrt 2), sqrt(load) = K(k) - F(phi0, k), t the tip angle below the axis.
  // With t = pi/2 - u the modulus stays accurate when the tip nearly points along the load: 1 - k^2 = sin^2(u/2).
  const auto modulus = [](double u) { return std::cos(u / 2); };
  const auto phi0 = [&](double u) { return std::asin(std::min(1.0, 1 / (modulus(u) * std::sqrt(2.0)))); };
  const double log_u = bisect(
      [&](double l) {
        const double u = std::exp(l), k = modulus(u);
        return std::comp_ellint_1(k) - std::ellint_1(k, phi0(u)) - std::sqrt(load);
      },
      std::log(1e-7), std::log(kPi / 2 * (1 - 1e-9)));
  const double u = std::exp(log_u), k = modulus(u);
  return {1 - 2 / std::sqrt(load) * (std::comp_ellint_2(k) - std::ellint_2(k, phi0(u))),
          std::sqrt(2 * std::cos(u) / load)};
}

double cantileverRoot(int mode)
{
  // cos(x) + 1/cosh(x) = 0 is the same equation without the overflow; its k-th root is near (k - 1/2) pi.
  const double guess = (mode - 0.5) * kPi;
  return bisect([](double x) { return std::cos(x) + 1 / std::cosh(x); }, guess - 0.5, guess + 0.5);
}

double cantileverMode(int mode, double s)
{
  const double b = cantileverRoot(mode), x = b * s;
  const double sigma = (std::sinh(b) - std::sin(b)) / (std::cosh(b) + std::cos(b));
  return std::cosh(x) - std::cos(x) - sigma * (std::sinh(x) - std::sin(x));
}

double cantileverModeSlope(int mode, double s)
{
  const double b = cantileverRoot(mode), x = b * s;
  const double sigma = (std::sinh(b) - std::sin(b)) / (std::cosh(b) + std::cos(b));
  return b * (std::sinh(x) + std::sin(x) - sigma * (std::cosh(x) - std::cos(x)));
}

}   // namespace slender::study
