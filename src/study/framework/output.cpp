#include "slender_sim/study/output.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <limits>
#include <ostream>

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "surface_script.h"

extern char** environ;

namespace slender::study {
namespace {

std::string format(double value, const char* pattern)
{
  char text[40];
  std::snprintf(text, sizeof text, pattern, value);
  return text;
}

std::string cell(const Row& row, const std::string& key, const char* pattern)
{
  const Row::Value* value = row.find(key);
  if (!value)
    return "";
  if (const double* number = std::get_if<double>(value))
    return format(*number, pattern);
  return std::get<std::string>(*value);
}

/// Keys of all rows: each placed behind the key that it follows in the row where it first occurs.
std::vector<std::string> columns(const StudyContext& context)
{
  std::vector<std::string> keys;
  for (const Row& row : context.rows())
  {
    std::size_t next = 0;
    for (const auto& entry : row.entries())
    {
      const auto known = std::find(keys.begin(), keys.end(), entry.first);
      if (known != keys.end())
        next = static_cast<std::size_t>(known - keys.begin()) + 1;
      else
        keys.insert(keys.begin() + static_cast<std::ptrdiff_t>(next++), entry.first);
    }
  }
  return keys;
}

std::string jsonString(const std::string& text)
{
  std::string out = "\"";
  for (const char c : text)
    if (c == '"' || c == '\\')
      out += std::string("\\") + c;
    else if (c == '\n')
      out += "\\n";
    else if (static_cast<unsigned char>(c) < 0x20)
    {
      char code[8];
      std::snprintf(code, sizeof code, "\\u%04x", static_cast<unsigned>(c));
      out += code;
    }
    else
      out += c;
  return out + "\"";
}

std::string jsonNumber(double value) { return std::isfinite(value) ? format(value, "%.15g") : "null"; }

void writeScript(std::ostream& out, const Plot& plot, const std::string& picture)
{
  out << "set terminal pngcairo size 1200,640 noenhanced font \"sans,12\"\n"
      << "set output " << gnuplotString(picture) << "\n"
      << "set title " << gnuplotString(plot.title) << "\n"
      << "set xlabel " << gnuplotString(plot.x_label) << "\nset ylabel " << gnuplotString(plot.y_label) << "\n"
      << "set key outside right center vertical Left reverse font \",10\"\nset grid\n";
  if (plot.equal_axes)
    out << "set size ratio -1\n";
  if (plot.log_x)
    out << "set logscale x\nset format x \"%g\"\n";
  if (plot.log_y)
    out << "set logscale y\nset format y \"%g\"\n";
  double least = std::numeric_limits<double>::infinity(), most = -least;
  for (const Series& s : plot.series)
    for (const double x : s.x)
    {
      least = std::min(least, x);
      most = std::max(most, x);
    }
  if (least == most && least > 0)   // a single abscissa: gnuplot would complain
    out << "set xrange [" << format(0.5 * least, "%g") << ":" << format(2 * most, "%g") << "]\n";
  std::size_t index = 0;
  for (const Series& s : plot.series)
  {
    out << "$series" << index++ << " << EOD\n";
    for (std::size_t i = 0; i < s.x.size(); ++i)
      if (std::isfinite(s.x[i]) && std::isfinite(s.y[i]) && (!plot.log_x || s.x[i] > 0) && (!plot.log_y || s.y[i] > 0))
        out << format(s.x[i], "%.9g") << " " << format(s.y[i], "%.9g") << "\n";
      else
        out << "\n";   // the line breaks here
    out << "EOD\n";
  }
  out << "plot ";
  index = 0;
  for (const Series& s : plot.series)
  {
    const bool line = s.line || (plot.lines && !s.points), markers = !s.line && (!line || plot.markers);
    out << (index ? ", \\\n     " : "") << "$series" << index << " using 1:2 with "
        << (!line     ? "points"
            : markers ? "linespoints"
                      : "lines");
    if (markers)
      out << " pointtype " << index % 13 + 4;
    out << " title " << gnuplotString(s.label);
    ++index;
  }
  out << "\n";
}

/// Runs gnuplot on a script without a shell. False when it cannot be run or fails; `missing` tells the two apart.
bool runGnuplot(const std::string& script, bool& missing)
{
  std::string program = "gnuplot", file = script;
  char* const arguments[] = {program.data(), file.data(), nullptr};
  pid_t child = 0;
  const int spawned = posix_spawnp(&child, "gnuplot", nullptr, nullptr, arguments, environ);
  missing = spawned != 0;
  if (missing)
    return false;
  int status = 0;
  while (waitpid(child, &status, 0) < 0)
    if (errno != EINTR)
      return false;
  // how older C libraries report a program that is not there
  missing = WIFEXITED(status) && WEXITSTATUS(status) == 127;
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

}   // namespace

void printTable(std::ostream& out, const StudyContext& context)
{
  const std::vector<std::string> keys = columns(context);
  std::vector<std::size_t> width;
  std::vector<bool> number(keys.size(), true);
  for (std::size_t k = 0; k < keys.size(); ++k)
  {
    width.push_back(keys[k].size());
    for (const Row& row : context.rows())
    {
      width[k] = std::max(width[k], cell(row, keys[k], "%.6g").size());
      if (const Row::Value* value = row.find(keys[k]))
        number[k] = number[k] && std::holds_alternative<double>(*value);
    }
  }
  const auto print = [&](const std::string& text, std::size_t k) {
    const std::string space(width[k] - std::min(width[k], text.size()), ' ');
    out << (k ? "  " : "") << (number[k] ? space + text : text + (k + 1 < keys.size() ? space : ""));
  };
  out << "== " << context.name() << "\n";
  for (std::size_t k = 0; k < keys.size(); ++k)
    print(keys[k], k);
  out << "\n";
  for (const Row& row : context.rows())
  {
    for (std::size_t k = 0; k < keys.size(); ++k)
      print(cell(row, keys[k], "%.6g"), k);
    out << "\n";
  }
  for (const auto& m : context.metrics())
    out << m.first << " = " << format(m.second, "%.6g") << "\n";
  for (const std::string& note : context.notes())
    out << "note: " << note << "\n";
  out << std::flush;
}

void writeJson(std::ostream& out, const std::vector<StudyResult>& results)
{
  out << "{\"studies\": [";
  for (std::size_t i = 0; i < results.size(); ++i)
  {
    const StudyContext& c = *results[i].context;
    out << (i ? ",\n" : "\n") << " {\"name\": " << jsonString(c.name()) << ",\n  \"metrics\": {";
    bool first = true;
    for (const auto& m : c.metrics())
    {
      out << (first ? "" : ", ") << jsonString(m.first) << ": " << jsonNumber(m.second);
      first = false;
    }
    out << "},\n  \"rows\": [";
    for (std::size_t r = 0; r < c.rows().size(); ++r)
    {
      out << (r ? ",\n   {" : "\n   {");
      first = true;
      for (const auto& entry : c.rows()[r].entries())
      {
        const double* number = std::get_if<double>(&entry.second);
        out << (first ? "" : ", ") << jsonString(entry.first) << ": "
            << (number ? jsonNumber(*number) : jsonString(std::get<std::string>(entry.second)));
        first = false;
      }
      out << "}";
    }
    out << "],\n";
    if (!c.notes().empty())
    {
      out << "  \"notes\": [";
      for (std::size_t k = 0; k < c.notes().size(); ++k)
        out << (k ? ", " : "") << jsonString(c.notes()[k]);
      out << "],\n";
    }
    if (!results[i].error.empty())
      out << "  \"error\": " << jsonString(results[i].error) << ",\n";
    out << "  \"wall_seconds\": " << jsonNumber(results[i].wall_seconds) << "}";
  }
  out << "\n]}\n";
}

std::string csvCell(const std::string& text)
{
  if (text.find_first_of(",\"\n") == std::string::npos)
    return text;
  std::string out = "\"";
  for (const char c : text)
    out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}

std::vector<std::string> csvCells(const std::string& line)
{
  std::vector<std::string> cells(1);
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i)
    if (line[i] == '"' && quoted && i + 1 < line.size() && line[i + 1] == '"')
      cells.back() += line[i++];
    else if (line[i] == '"')
      quoted = !quoted;
    else if (line[i] == ',' && !quoted)
      cells.emplace_back();
    else
      cells.back() += line[i];
  return cells;
}

std::string valueText(const Row& row, const std::string& key) { return cell(row, key, "%.12g"); }

void writeCsv(std::ostream& out, const StudyContext& context)
{
  const std::vector<std::string> keys = columns(context);
  for (std::size_t k = 0; k < keys.size(); ++k)
    out << (k ? "," : "") << csvCell(keys[k]);
  out << "\n";
  for (const Row& row : context.rows())
  {
    for (std::size_t k = 0; k < keys.size(); ++k)
      out << (k ? "," : "") << csvCell(valueText(row, keys[k]));
    out << "\n";
  }
}

std::string writePlots(const std::string& directory, const StudyContext& context)
{
  const auto drawn = [&](const std::string& name, const auto& write) -> std::string {
    const std::string base = directory + "/" + name;
    {
      std::ofstream script(base + ".gp");
      write(script, base + ".png");
      if (!script)
        return "cannot write " + base + ".gp";
    }
    bool missing = false;
    if (!runGnuplot(base + ".gp", missing))
      return missing ? "gnuplot is not installed: no PNG; the script " + base + ".gp draws it (apt install gnuplot-nox)"
                     : "gnuplot failed on " + base + ".gp";
    return "";
  };
  std::string problem;
  for (const Plot& plot : context.plots())
  {
    const bool drawable =
        std::any_of(plot.series.begin(), plot.series.end(), [](const Series& s) { return !s.x.empty(); });
    if (drawable && problem.empty())
      problem = drawn(plot.name, [&](std::ostream& out, const std::string& png) { writeScript(out, plot, png); });
  }
  for (const SurfacePicture& picture : context.pictures())
    if (problem.empty() && !picture.panels.empty())
      problem = drawn(picture.name,
                      [&](std::ostream& out, const std::string& png) { writeSurfaceScript(out, picture, png); });
  return problem;
}

}   // namespace slender::study
