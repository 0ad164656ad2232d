#pragma once

#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <ros/node_handle.h>

namespace slender {

/// A private parameter that cannot be used; what() names it, its value and what is allowed.
class OptionError : public std::runtime_error
{
public:
  using std::runtime_error::runtime_error;
};

enum class Pace
{
  wall,     ///< keeps real time if possible; never skips steps, but skips its clock if it is ~max_lag behind
  fast,     ///< steps as fast as possible
  follow,   ///< steps up to the incoming /clock
  step,     ///< steps only when the service ~step is called
};

/// Axes and tf frame of `grasps/NAME/wrench`.
enum class WrenchFrame
{
  automatic,   ///< those of the grasp in scenes with at most 64 grasps, otherwise those of the node's frame
  grasp,
  world,
};

enum class MarkerStyle
{
  tube,
  line,
  regions
};
enum class MarkerColor
{
  none,
  strain,
  curvature,
  twist
};

/// Contents of pictures besides the shapes of objects.
struct MarkerOptions
{
  MarkerStyle style = MarkerStyle::tube;   ///< ~marker_style: tube | line | regions (of tracked cloths)
  bool frames = false;                     ///< ~marker_frames: material frames
  MarkerColor color = MarkerColor::none;   ///< ~marker_color: none | strain | curvature | twist
  /// ~marker_range: magnitude of the full colour: strain [-], curvature [1/m], twist [rad/m]; 0: the picture's largest
  double range = 0.0;
  /// ~marker_forces [m/N]: length of the arrows of contact forces and of forces on grasps; 0: no arrows
  double forces = 0.0;
  /// Height of the legend's letters [m]. With 0 it follows the present size of the scene. No parameter sets it.
  double letters = 0.0;
  /// extra line of the legend, which no parameter sets: how fast time passes in the picture; empty: no line
  std::string note;
};

/// Private parameters of rod_node, thread_node, cloth_node and tracking_node, with their defaults.
struct NodeOptions
{
  std::string scene;                    ///< ~scene: path of the scene file, or its YAML text
  std::vector<std::string> overrides;   ///< ~set: list of "path=value", or one such string
  std::string frame_id = "world";       ///< ~frame_id of everything published
  Pace pace = Pace::wall;               ///< ~pace
  /// ~start_time [s] > 0; default: ROS time now (wall), first /clock (follow), else 1
  std::optional<double> start_time;
  double stop_after = 0.0;   ///< ~stop_after [s] simulated, then the node ends; 0: never
  double speed = 1.0;        ///< ~speed > 0: simulated over wall time, with ~pace: wall
  /// ~max_lag [s]: behind the wall clock by more than that, the clock skips to the present; 0: never
  double max_lag = 1.0;
  bool publish_clock = false;   ///< ~publish_clock: the node publishes /clock; needs /use_sim_time
  bool paused = false;          ///< ~paused: start paused
  int state_every = 1;          ///< ~state_every: steps between state, poses and wrench messages
  std::string record_bag;       ///< ~record_bag: path; empty: no bag
  bool record_inputs = true;    ///< ~record_inputs: record inputs into this bag, for ~replay
  std::string replay;           ///< ~replay: path of the bag whose run is repeated; empty: none
  WrenchFrame wrench_frame = WrenchFrame::automatic;   ///< ~wrench_frame: auto | grasp | world
  double wrench_filter = 0.05;     ///< ~wrench_filter [s], time constant of grasps/NAME/wrench_filtered
  double guide_delay = 0.05;       ///< ~guide_delay [s] behind which grasps follow their guides
  bool guide_delay_auto = false;   ///< ~guide_delay: auto
  /// guides come in real time: with ~pace: wall (of a replay: of the run that it repeats)
  bool live_guides = true;
  /// ~guide_timeout [s]: older guides are stale; no guide for so long: WARN
  double guide_timeout = 1.0;
  /// ~guide_ahead [s]: guides stamped later than that after the simulated time are refused
  double guide_ahead = 10.0;
  double catch_up_time = 0.1;      ///< ~catch_up_time [s] shortest time for closing a gap
  double catch_up_speed = 1.0;     ///< ~catch_up_speed [m/s] when closing a gap
  double tf_timeout = 0.5;         ///< ~tf_timeout [s] wall time that a message waits for its transform
  double diagnostics_rate = 1.0;   ///< ~diagnostics_rate [Hz]
  double marker_rate = 30.0;       ///< ~marker_rate [Hz] at most, up to 30
  /// ~marker_style, ~marker_frames, ~marker_color, ~marker_range, ~marker_forces
  MarkerOptions markers;
  bool interactive = false;   ///< ~interactive: handles in rviz for what messages move

  /// Reads and checks them all; throws OptionError on the first that does not fit, unknown names included.
  static NodeOptions read(const ros::NodeHandle& nh_priv);
};

const char* toString(Pace pace);

}   // namespace slender
