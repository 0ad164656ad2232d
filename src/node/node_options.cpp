#include "slender_sim/node/node_options.h"

#include "param_reader.h"

namespace slender {

NodeOptions NodeOptions::read(const ros::NodeHandle& nh_priv)
{
  NodeOptions o;
  ParamReader params(nh_priv);
  params.read("scene", o.scene);
  params.readList("set", o.overrides);
  params.read("frame_id", o.frame_id);
  params.read<Pace>("pace", o.pace,
                    {{"wall", Pace::wall}, {"fast", Pace::fast}, {"follow", Pace::follow}, {"step", Pace::step}});
  double start = 0.0;
  params.read("start_time", start, 0.0, 4.0e9);   // stamps hold 32 bits of seconds
  if (start > 0.0)
    o.start_time = start;
  params.read("stop_after", o.stop_after, 0.0, 1e9);
  params.read("publish_clock", o.publish_clock);
  params.read("paused", o.paused);
  params.read("state_every", o.state_every, 1, 1000000);
  params.read("record_bag", o.record_bag);
  params.read("record_inputs", o.record_inputs);
  params.read("replay", o.replay);
  params.read("speed", o.speed, 0.0, 1000.0, true);
  params.read("max_lag", o.max_lag, 0.0, 1e6);
  o.guide_delay_auto = params.is("guide_delay", "auto");
  if (!o.guide_delay_auto)
    params.read("guide_delay", o.guide_delay, 0.0, 100.0, false, " or auto");
  o.live_guides = o.pace == Pace::wall;
  params.read("guide_timeout", o.guide_timeout, 0.0, 1e6, true);
  params.read("guide_ahead", o.guide_ahead, 0.0, 1e6, true);
  params.read("catch_up_time", o.catch_up_time, 0.0, 100.0, true);
  params.read("catch_up_speed", o.catch_up_speed, 0.0, 1e6, true);
  params.read("tf_timeout", o.tf_timeout, 0.0, 100.0);
  params.read("diagnostics_rate", o.diagnostics_rate, 0.0, 1000.0, true);
  params.read("marker_rate", o.marker_rate, 0.0, 30.0, true);
  params.read<MarkerStyle>(
      "marker_style", o.markers.style,
      {{"tube", MarkerStyle::tube}, {"line", MarkerStyle::line}, {"regions", MarkerStyle::regions}});
  params.read("interactive", o.interactive);
  params.read<WrenchFrame>(
      "wrench_frame", o.wrench_frame,
      {{"auto", WrenchFrame::automatic}, {"grasp", WrenchFrame::grasp}, {"world", WrenchFrame::world}});
  params.read("wrench_filter", o.wrench_filter, 0.0, 100.0, true);
  params.read("marker_frames", o.markers.frames);
  params.read<MarkerColor>("marker_color", o.markers.color,
                           {{"none", MarkerColor::none},
                            {"strain", MarkerColor::strain},
                            {"curvature", MarkerColor::curvature},
                            {"twist", MarkerColor::twist}});
  params.read("marker_range", o.markers.range, 0.0, 1e9);
  params.read("marker_forces", o.markers.forces, 0.0, 1e9);
  params.refuseUnknown();
  if (o.guide_delay_auto && o.pace != Pace::wall)
    throw OptionError(std::string("~guide_delay: auto depends on when guides arrive, so that runs with ~pace: ") +
                      toString(o.pace) + " would differ; give a number, two message intervals and the transport [s]");
  if (o.speed != 1.0 && o.pace != Pace::wall)
    throw OptionError(std::string("~speed: is for ~pace: wall; ~pace: ") + toString(o.pace) +
                      " has a speed of its own");
  if (!o.replay.empty() && (o.pace == Pace::follow || o.start_time))
    throw OptionError("~replay: keeps the recorded stamps, and needs neither ~pace: follow nor ~start_time");
  if (o.scene.empty() && o.replay.empty())
    throw OptionError("~scene: missing; give the path of a scene file (or its YAML text)");
  if (o.frame_id.empty())
    throw OptionError("~frame_id: is empty, must be the name of a frame, e.g. world");
  if (o.frame_id.find_first_of(" \t\n") != std::string::npos)
    throw OptionError("~frame_id: is \"" + o.frame_id + "\", must be one word");
  if (o.frame_id.front() == '/')
    throw OptionError("~frame_id: is " + o.frame_id + ", must not begin with a slash: tf2 knows no such frames");
  return o;
}

const char* toString(Pace pace)
{
  static const char* const words[] = {"wall", "fast", "follow", "step"};
  return words[static_cast<int>(pace)];
}

}   // namespace slender
