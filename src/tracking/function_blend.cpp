#include "slender_sim/tracking/function_blend.h"

namespace slender {

FunctionBlend FunctionBlend::between(const WeakConstraints& functions, const Eigen::Matrix3Xd& guide,
                                     const Eigen::Matrix3Xd& guide_velocity, const Eigen::Matrix3Xd& x,
                                     const Eigen::Matrix3Xd& v, double start, double duration)
{
  FunctionBlend blend;
  if (!(duration > 0))
    return blend;
  blend.gap = functions.averages(guide) - x * functions.matrix().transpose();
  blend.rate = functions.averages(guide_velocity) - v * functions.matrix().transpose();
  blend.start = start;
  blend.duration = duration;
  return blend;
}

bool FunctionBlend::active(double time) const
{
  constexpr double kRounding = 1e-9;   // of the duration: times of steps are rounded
  return gap.cols() > 0 && time < start + (1.0 - kRounding) * duration;
}

FunctionBlend::Shares FunctionBlend::sharesAt(double time) const
{
  const double s = (time - start) / duration, rest = 1.0 - s;
  return {rest * rest * (1.0 + 2.0 * s), duration * s * rest * rest};
}

void FunctionBlend::apply(double time, Eigen::Matrix3Xd& averages) const
{
  if (!active(time))
    return;
  const Shares shares = sharesAt(time);
  averages -= shares.gap * gap + shares.rate * rate;
}

double FunctionBlend::left(double time) const
{
  if (!active(time))
    return 0.0;
  const Shares shares = sharesAt(time);
  return (shares.gap * gap + shares.rate * rate).colwise().norm().maxCoeff();
}

}   // namespace slender
