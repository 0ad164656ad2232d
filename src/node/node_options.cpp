#include "slender_sim/node/node_options.h"

#include <cmath>
#include <set>
#include <sstream>

#include <XmlRpcValue.h>

namespace slender {
namespace {

/// Typed reading of private parameters. rosparam hands over `1e-3` or "0.5" as strings and `1` as an integer where a double is
/// meant; param<double>() would silently fall back to its default then, so values are converted here or refused.
class ParamReader
{
public:
  explicit ParamReader(const ros::NodeHandle& nh) : nh_(nh) {}

  bool get(const std::string& name, XmlRpc::XmlRpcValue& value)
  {
    known_.insert(name);
    return nh_.getParam(name, value);
  }

  void read(const std::string& name, double& value, double low, double high, bool open_low = false)
  {
    XmlRpc::XmlRpcValue v;
    if (!get(name, v))
      return;
    double number = std::nan("");
    if (v.getType() == XmlRpc::XmlRpcValue::TypeDouble)
      number = static_cast<double>(v);
    else if (v.getType() == XmlRpc::XmlRpcValue::TypeInt)
      number = static_cast<int>(v);
    else if (v.getType() == XmlRpc::XmlRpcValue::TypeString)
    {
      const std::string text = static_cast<std::string>(v);
      std::istringstream in(text);
      if (!(in >> number) || !(in >> std::ws).eof())
        number = std::nan("");
    }
    if (!std::isfinite(number) || number < low || number > high || (open_low && number == low))
    {
      std::ostringstream range;
      range << "a number in " << (open_low ? "(" : "[") << low << ", " << high << "]";
      refuse(name, v, range.str());
    }
    value = number;
  }

  void read(const std::string& name, int& value, int low, int high)
  {
    double number = value;
    read(name, number, low, high);
    if (number != std::floor(number))
      throw OptionError("~" + name + ": must be a whole number");
    value = static_cast<int>(number);
  }

  void read(const std::string& name, bool& value)
  {
    XmlRpc::XmlRpcValue v;
    if (!get(name, v))
      return;
    if (v.getType() == XmlRpc::XmlRpcValue::TypeBoolean)
      value = static_cast<bool>(v);
    else if (v.getType() == XmlRpc::XmlRpcValue::TypeInt && (static_cast<int>(v) == 0 || static_cast<int>(v) == 1))
      value = static_cast<int>(v) == 1;
    else
      refuse(name, v, "true or false");
  }

  void read(const std::string& name, std::string& value)
  {
    XmlRpc::XmlRpcValue v;
    if (!get(name, v))
      return;
    if (v.getType() != XmlRpc::XmlRpcValue::TypeString)
      refuse(name, v, "a string");
    value = static_cast<std::string>(v);
  }

  template <typename E>
  void read(const std::string& name, E& value, const std::vector<std::pair<std::string, E>>& choices)
  {
    std::string text;
    XmlRpc::XmlRpcValue v;
    if (!get(name, v))
      return;
    std::string allowed;
    for (const auto& choice : choices)
    {
      if (v.getType() == XmlRpc::XmlRpcValue::TypeString && static_cast<std::string>(v) == choice.first)
      {
        value = choice.second;
        return;
      }
      allowed += (allowed.empty() ? "" : " | ") + choice.first;
    }
    refuse(name, v, allowed);
  }

  void readList(const std::string& name, std::vector<std::string>& value)
  {
    XmlRpc::XmlRpcValue v;
    if (!get(name, v))
      return;
    value.clear();
    if (v.getType() == XmlRpc::XmlRpcValue::TypeString)
    {
      if (!static_cast<std::string>(v).empty())
        value.push_back(static_cast<std::string>(v));
      return;
    }
    if (v.getType() != XmlRpc::XmlRpcValue::TypeArray)
      refuse(name, v, "a list of strings path=value");
    for (int i = 0; i < v.size(); ++i)
    {
      if (v[i].getType() != XmlRpc::XmlRpcValue::TypeString)
        refuse(name, v, "a list of strings path=value");
      value.push_back(static_cast<std::string>(v[i]));
    }
  }

  /// Names nobody asked for are most likely misspelt.
  void refuseUnknown() const
  {
    std::vector<std::string> names;
    nh_.getParamNames(names);
    const std::string prefix = nh_.getNamespace() + "/";
    for (const std::string& full : names)
    {
      if (full.compare(0, prefix.size(), prefix) != 0)
        continue;
      const std::string name = full.substr(prefix.size(), full.find('/', prefix.size()) - prefix.size());
      if (known_.count(name))
        continue;
      std::string list;
      for (const std::string& k : known_)
        list += " " + k;
      throw OptionError("~" + name + ": no such parameter; known are:" + list);
    }
  }

private:
  [[noreturn]] static void refuse(const std::string& name, const XmlRpc::XmlRpcValue& value, const std::string& allowed)
  {
    std::ostringstream text;
    text << "~" << name << ": is " << value << ", must be " << allowed;
    throw OptionError(text.str());
  }

  ros::NodeHandle nh_;
  std::set<std::string> known_;
};

}  // namespace

NodeOptions NodeOptions::read(const ros::NodeHandle& nh_priv)
{
  NodeOptions o;
  ParamReader params(nh_priv);
  params.read("scene", o.scene);
  params.readList("set", o.overrides);
  params.read("frame_id", o.frame_id);
  params.read<Pace>("pace", o.pace, {{"wall", Pace::wall}, {"fast", Pace::fast}, {"follow", Pace::follow}, {"step", Pace::step}});
  double start = 0.0;
  params.read("start_time", start, 0.0, 4.0e9);   // stamps hold 32 bits of seconds
  if (start > 0.0)
    o.start_time = start;
  params.read("stop_after", o.stop_after, 0.0, 1e9);
  params.read("publish_clock", o.publish_clock);
  params.read("paused", o.paused);
  params.read("state_every", o.state_every, 1, 1000000);
  params.read("record_bag", o.record_bag);
  params.read("guide_delay", o.guide_delay, 0.0, 100.0);
  params.read("guide_timeout", o.guide_timeout, 0.0, 1e6, true);
  params.read("guide_ahead", o.guide_ahead, 0.0, 1e6, true);
  params.read("catch_up_time", o.catch_up_time, 0.0, 100.0, true);
  params.read("catch_up_speed", o.catch_up_speed, 0.0, 1e6, true);
  params.read("tf_timeout", o.tf_timeout, 0.0, 100.0);
  params.read("diagnostics_rate", o.diagnostics_rate, 0.0, 1000.0, true);
  params.read("marker_rate", o.marker_rate, 0.0, 30.0, true);
  params.read<MarkerStyle>("marker_style", o.markers.style, {{"tube", MarkerStyle::tube}, {"line", MarkerStyle::line}, {"regions", MarkerStyle::regions}});
  params.read("interactive", o.interactive);
  params.read("marker_frames", o.markers.frames);
  params.read<MarkerColor>("marker_color", o.markers.color,
                           {{"none", MarkerColor::none}, {"strain", MarkerColor::strain}, {"curvature", MarkerColor::curvature}, {"twist", MarkerColor::twist}});
  params.read("marker_range", o.markers.range, 0.0, 1e9);
  params.read("marker_forces", o.markers.forces, 0.0, 1e9);
  params.refuseUnknown();
  if (o.scene.empty())
    throw OptionError("~scene: missing; give the path of a scene file (or its YAML text)");
  if (o.frame_id.empty())
    throw OptionError("~frame_id: is empty, must be the name of a frame, e.g. world");
  if (o.frame_id.front() == '/')
    throw OptionError("~frame_id: is " + o.frame_id + ", must not begin with a slash: tf2 knows no such frames");
  return o;
}

const char* toString(Pace pace)
{
  switch (pace)
  {
    case Pace::wall: return "wall";
    case Pace::fast: return "fast";
    case Pace::follow: return "follow";
    case Pace::step: return "step";
  }
  return "?";
}

}  // namespace slender
