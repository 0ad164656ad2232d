#pragma once

#include <algorithm>
#include <optional>

#include "slender_sim/node/catch_up.h"
#include "slender_sim/node/guide_timing.h"

namespace slender {

/// Follows a stream of stamped samples in simulated time: what GuideBuffer and PointGuideBuffer have in common.
/// `Trajectory` joins the samples (PoseTrajectory, PointTrajectory). It is evaluated at instants that GuideTiming
/// chooses. The derived class evaluates it and blends from the last output to a trajectory that has changed.
template <class Trajectory>
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
  /// Called when the last evaluated motion is no longer that of the trajectory at query_.
  virtual void forgetPlain() = 0;
  /// The trajectory may have changed at query_. Starts a blend from the last output, given at simulated `time` [s],
  /// unless they agree.
  virtual void rejoin(double time) = 0;
  /// Sets the output at simulated `time` [s] from the trajectory at query_, which passes at rate_.
  virtual void output(double time) = 0;

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

  /// Goes on to simulated `time` [s], which does not decrease from call to call. Calls output() once a stream has taken
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
  void endFade() { fade_duration_ = 0.0; }
  /// Whether there is an offset at this time.
  bool fades(double time) const { return fade_duration_ > 0.0 && time < fade_start_ + fade_duration_; }
  FadeWeights fade(double time) const { return fadeOut(time - fade_start_, fade_duration_, fade_rate_duration_); }

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

private:
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
};

}   // namespace slender
