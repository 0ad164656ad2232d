#include "moduli.h"

#include <algorithm>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

namespace slender {
namespace {

std::string rangeOf(double low, double high)
{
  char text[64];
  std::snprintf(text, sizeof text, high - low > 1e-9 * high ? "%.6g to %.6g" : "%.6g", low, high);
  return text;
}

}   // namespace

void printModuli(const Simulation& simulation)
{
  constexpr int kMostLines = 10;
  std::vector<std::pair<std::string, int>> lines;   // and the number of further rods that have the same moduli
  const int rods = static_cast<int>(simulation.config().rods.size());
  for (int r = 0; r < rods; ++r)
  {
    const RodModel& m = simulation.rodModel(r);
    const auto bend = [&m](int row) {
      return rangeOf(m.bend_modulus.row(row).minCoeff(), m.bend_modulus.row(row).maxCoeff());
    };
    const std::string bends = bend(0) == bend(2) ? bend(0) : "[" + bend(0) + ", " + bend(2) + "]";
    const std::string text = "stretch " + rangeOf(m.stretch_modulus.minCoeff(), m.stretch_modulus.maxCoeff()) +
                             " N, bend " + bends + " N m^2, twist " +
                             rangeOf(m.twist_modulus.minCoeff(), m.twist_modulus.maxCoeff()) + " N m^2";
    const auto ends = [&text](const std::string& line) {
      return line.size() > text.size() && line.compare(line.size() - text.size(), text.size(), text) == 0;
    };
    const auto same = std::find_if(lines.begin(), lines.end(), [&ends](const auto& line) { return ends(line.first); });
    if (same != lines.end())
      ++same->second;
    else if (static_cast<int>(lines.size()) <= kMostLines)
      lines.emplace_back("rod " + m.name + ": " + text, 0);
  }
  for (std::size_t k = 0; k < lines.size() && k < kMostLines; ++k)
  {
    std::printf("moduli            %s", lines[k].first.c_str());
    lines[k].second > 0 ? std::printf(" (and %d more rods)\n", lines[k].second) : std::printf("\n");
  }
  if (static_cast<int>(lines.size()) > kMostLines)
    std::printf("moduli            other rods have other moduli\n");
}

}   // namespace slender
