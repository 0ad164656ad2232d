#pragma once

#include <algorithm>
#include <optional>

#include "slender_sim/node/guide_timing.h"

namespace slender {

/// [s] a limit from the right is evaluated this much later; shorter than any step
constexpr double kLimitOffset = 1e-7;
/// [s] an extrapolated motion would come to rest in this time at a constant rate
constexpr double kOpenCoast = 0.5;
constexpr double kDryBlend = 0.3;       ///< [s] shortest blending time after a stream ran dry, whose offsets are small
constexpr double kSameMotion = 1e-10;   ///< [m], [rad] round-off of evaluating the same motion twice

/// Weights of an offset and of its rate at one instant: offset(t) = value * offset(0) + slope * rate(0), and the
/// derivative of that with respect to time.
struct FadeWeights
{
  double value = 0.0;        ///< [1]
  double slope = 0.0;        ///< [s]
  double value_rate = 0.0;   ///< [1/s]
  double slope_rate = 0.0;   ///< [1]
};

/// Weights of the cubic Hermite polynomial that takes an offset to zero within `duration` [s] > 0 and its rate within
/// `rate_duration` [s] > 0. The rate has a duration of its own, because a rate that fades over a long time would lead
/// far away. `elapsed` [s] is the time since the start; outside of the durations the polynomial keeps its end values.
inline FadeWeights fadeOut(double elapsed, double duration, double rate_duration)
{
  const double s = std::clamp(elapsed / duration, 0.0, 1.0);
  const double u = std::clamp(elapsed / rate_duration, 0.0, 1.0);
  FadeWeights weights;
  weights.value = (1 + 2 * s) * (1 - s) * (1 - s);
  weights.slope = rate_duration * u * (1 - u) * (1 - u);
  weights.value_rate = 6 * s * (s - 1) / duration;
  weights.slope_rate = (1 - u) * (1 - 3 * u);
  return weights;
}

/// Follows a stream of stamped samples in simulated time: what GuideBuffer and PointGuideBuffer have in common.
/// `Trajectory` joins the samples (PoseTrajectory, PointTrajectory). It is evaluated at instants that GuideTiming
/// chooses. If new samples have changed the trajectory at the last instant, an offset leads from the last output to the
/// trajectory, and fades. `Motion` is a place and its velocity. The derived class evaluates the trajectory and stores
/// the offset.
template <class Trajectory, class Motion>
class GuideStream
{
public:
  /// Stamp of the last sample [s], if there is any.
  std::optional<double> lastTime() const { return last_stamp_; }
  const GuideTiming& timing() const { return timing_; }
  /// See GuideTiming::lagAtLeast().
  void lagAtLeast(double lag) { timing_.lagAtLeast(lag); }
  /// The simulated clock skipped `seconds` while the output stood still. What follows the stream then catches up.
  void skip(double seconds)
  {
    timing_.skip(seconds);
    query_ += seconds;
    fade_start_ += seconds;
    forgetPlain();
    if (last_time_)
      *last_time_ += seconds;
    changed_ = true;
  }

protected:
  /// `blend` [s] > 0: shortest time in which an offset fades, from rest to the speed of a stream, or back. If the
  /// interval of the samples is shorter, streams may begin and end in motion. Otherwise they begin and end at rest.
  GuideStream(const GuideTiming::Options& timing, double blend)
    : timing_(timing),
      coast_(timing.coast),
      blend_(blend),
      cut_(timing.delay > 0.0 || timing.automatic ? blend : 0.0)   // without a lag each new sample is an end at first
  {
  }
  virtual ~GuideStream() = default;

  /// Called when the first stream takes effect. trajectory_ begins at `start` [s].
  virtual void join(double start) = 0;
  /// Evaluates the trajectory at an instant that passes at this rate.
  virtual void follow(double query, double rate, Motion& motion) const = 0;
  /// Adds the offset at simulated `time` [s] to a motion of the trajectory. Called only while there is one.
  virtual void addOffset(double time, Motion& motion) const = 0;
  /// Starts an offset at simulated `time` [s] that leads from `from` to `to`, unless `from` is what output() would give
  /// for `to`. The trajectory was evaluated kLimitOffset later than `from`, so the two may differ by what passes in
  /// that time.
  virtual void blend(double time, const Motion& from, const Motion& to) = 0;

  /// Returns true if `time` [s] is later than the last sample.
  bool isNew(double time) const { return !last_stamp_ || time > *last_stamp_; }

  /// Adds a sample that is new.
  template <class Sample>
  void append(double time, const Sample& sample)
  {
    const bool fresh = timing_.sample(time);
    if (fresh && !trajectory_.empty())
      next_ = Trajectory();
    (next_ ? *next_ : trajectory_).append(time, sample);
    last_stamp_ = time;
    changed_ = true;
  }

  /// Goes on to simulated `time` [s], which does not decrease from call to call. Sets last_ once a stream has taken
  /// effect.
  void advance(double time)
  {
    GuideTiming::Instant now = timing_.advance(time);
    if (now.began)
      begin(time, now);
    else if (!now.following && following_)   // the earlier stream goes on until the next one takes effect
      now.time = query_ + rate_ * (time - *last_time_);
    if (now.jumped)
    {
      query_ = now.time;
      rate_ = now.rate;
      forgetPlain();
      changed_ = true;
    }
    if (following_)
    {
      if (now.following && now.open != open_ && coast_ == 0.0)
      {
        open_ = now.open;
        trajectory_.coast(open_ ? kOpenCoast : 0.0);
        changed_ = true;
      }
      if (changed_)
        rejoin(*last_time_);
      changed_ = false;
      if (!now.jumped)
        halt(time, now);
      query_ = now.time;
      rate_ = now.rate;
      output(time);
      trajectory_.forgetBefore(query_);
    }
    last_time_ = time;
  }

  /// An offset between the output and the trajectory begins at simulated `time` [s]. It fades within `catch_up` [s],
  /// or in the shortest time of blending if that is longer.
  void beginFade(double time, double catch_up)
  {
    fade_start_ = time;
    fade_rate_duration_ = timing_.overran() ? std::max(blend_, kDryBlend) : blend_;
    fade_duration_ = std::max(fade_rate_duration_, catch_up);
  }
  FadeWeights fade(double time) const { return fadeOut(time - fade_start_, fade_duration_, fade_rate_duration_); }

  /// The output stands still at `place`, whose velocity is zero, and then catches up with the stream.
  void standAt(const Motion& place)
  {
    last_ = place;
    endFade();
    if (following_)
      blendFromLast(*last_time_);
  }

  /// Adds the offset if there is one at simulated `time` [s].
  void fadeIn(double time, Motion& motion) const
  {
    if (fade_duration_ > 0.0 && time < fade_start_ + fade_duration_)
      addOffset(time, motion);
  }

  /// Forgets all samples, and the offset.
  void restartStream()
  {
    endFade();
    timing_.restart();
    trajectory_ = Trajectory();
    next_.reset();
    last_stamp_.reset();
    following_ = changed_ = open_ = false;
  }

  GuideTiming timing_;
  Trajectory trajectory_;
  bool following_ = false;            // samples have taken effect
  std::optional<double> last_time_;   // [s] simulated time of the last query
  double query_ = 0.0, rate_ = 1.0;   // [s] instant of the trajectory at last_time_, and its rate
  Motion last_;                       // last output

private:
  void endFade() { fade_duration_ = 0.0; }
  void forgetPlain() { plain_.reset(); }

  /// Sets the output at simulated `time` [s] from the trajectory at query_, which passes at rate_.
  void output(double time)
  {
    if (!plain_)
      plain_.emplace();
    follow(query_, rate_, *plain_);
    last_ = *plain_;
    fadeIn(time, last_);
  }

  /// Starts a blend from the last output, given at simulated `time` [s], if the trajectory has changed at query_.
  void rejoin(double time)
  {
    Motion now;
    follow(query_, rate_, now);
    if (!plain_ || !(now == *plain_))
      blendFromLast(time);
  }

  void blendFromLast(double time)
  {
    Motion to;
    follow(query_ + kLimitOffset, rate_, to);
    blend(time, last_, to);
  }

  /// Handles a motion that runs past its last sample and stops there. The jump in velocity becomes an offset, which is
  /// blended out.
  void halt(double time, const GuideTiming::Instant& now)
  {
    const double end = trajectory_.times().back();
    if (cut_ == 0.0 || coast_ > 0.0 || open_ || query_ >= end || now.time < end || trajectory_.times().size() < 3)
      return;
    const double when = *last_time_ + (time - *last_time_) * (end - query_) / std::max(now.time - query_, end - query_);
    query_ = end - kLimitOffset;
    rate_ = now.rate;
    output(when);   // with the speed just before the end
    query_ = end;
    forgetPlain();
    rejoin(when);
  }

  /// Lets the newest stream take effect, which is the first one or one after a pause.
  void begin(double time, const GuideTiming::Instant& now)
  {
    if (next_)
      trajectory_ = std::move(*next_);
    next_.reset();
    trajectory_.coast(coast_);
    trajectory_.cutWithin(cut_);
    trajectory_.expectMore();
    open_ = false;
    const double start = trajectory_.times().front();
    if (!following_)
      join(start);
    following_ = changed_ = true;
    forgetPlain();   // no earlier query was made of this trajectory
    last_time_ = now.rate > 0.0 ? time - (now.time - start) : time;
    query_ = start;
    rate_ = now.rate;
  }

  double coast_, blend_, cut_;
  double fade_start_ = 0.0, fade_duration_ = 0.0, fade_rate_duration_ = 0.0;   // [s]; no offset while it lasts for 0
  std::optional<Trajectory> next_;     // of a new stream that has not taken effect yet
  std::optional<double> last_stamp_;   // [s] of the last sample
  bool changed_ = false;               // the trajectory changed since the last query
  bool open_ = false;                  // the end of the trajectory is extrapolated
  std::optional<Motion> plain_;        // motion without an offset at last_time_, where it is that of the trajectory
};

}   // namespace slender
