#pragma once

#include <cmath>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <XmlRpcValue.h>
#include <ros/node_handle.h>

#include "slender_sim/node/node_options.h"

namespace slender {

/// Typed reading of private parameters. rosparam hands over `1e-3` or "0.5" as strings and `1` as an integer where a
/// double is meant; param<double>() would silently fall back to its default then, so values are converted here or
/// refused.
class ParamReader
{
public:
  explicit ParamReader(const ros::NodeHandle& nh) : nh_(nh) {}

  bool get(const std::string& name, XmlRpc::XmlRpcValue& value)
  {
    known_.insert(name);
    return nh_.getParam(name, value);
  }

  /// True when the parameter is this very word.
  bool is(const std::string& name, const std::string& word)
  {
    XmlRpc::XmlRpcValue v;
    return get(name, v) && v.getType() == XmlRpc::XmlRpcValue::TypeString && static_cast<std::string>(v) == word;
  }

  /// `or_else`: what the message adds to the range of numbers.
  void read(const std::string& name, double& value, double low, double high, bool open_low = false,
            const std::string& or_else = "")
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
      range << "a number in " << (open_low ? "(" : "[") << low << ", " << high << "]" << or_else;
      refuse(name, v, range.str());
    }
    value = number;
  }

  void read(const std::string& name, int& value, int low, int high)
  {
    double number = value;
    read(name, number, low, high);
    if (number != std::floor(number))
      throw OptionError("~" + name + ": must be a whole number" + whence(name));
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

  /// A list of strings; a string alone is a list of one.
  void readList(const std::string& name, std::vector<std::string>& value)
  {
    XmlRpc::XmlRpcValue v;
    if (!get(name, v))
      return;
    value.clear();
    if (v.getType() == XmlRpc::XmlRpcValue::TypeString)
    {
      const std::string text = static_cast<std::string>(v);
      if (text.compare(0, 1, "[") == 0)
        refuse(name, v,
               "one string here; lists come from a launch file (<rosparam param=\"" + name + "\">) or rosparam set");
      if (!text.empty())
        value.push_back(text);
      return;
    }
    if (v.getType() != XmlRpc::XmlRpcValue::TypeArray)
      refuse(name, v, "a list of strings");
    for (int i = 0; i < v.size(); ++i)
    {
      if (v[i].getType() != XmlRpc::XmlRpcValue::TypeString)
        refuse(name, v, "a list of strings");
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
      throw OptionError("~" + name + ": no such parameter; known are:" + list + whence(name));
    }
  }

  [[noreturn]] void refuse(const std::string& name, const XmlRpc::XmlRpcValue& value, const std::string& allowed) const
  {
    std::ostringstream text;
    text << "~" << name << ": is " << value << ", must be " << allowed << whence(name);
    throw OptionError(text.str());
  }

private:
  /// Parameters outlive the node that was started with them.
  std::string whence(const std::string& name) const
  {
    return " (an earlier start may have left it: rosparam delete " + nh_.resolveName(name) + ")";
  }

  ros::NodeHandle nh_;
  std::set<std::string> known_;
};

}   // namespace slender
