#pragma once

#include <ostream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"

namespace slender::test {

/// Returns what the reader says about a scene "test.yaml" that it refuses, or an empty text if it takes the scene.
inline std::string problemsOf(const std::string& text, const std::vector<std::string>& overrides = {})
{
  try
  {
    parseScene(text, "test.yaml", overrides);
  }
  catch (const SceneError& error)
  {
    return error.what();
  }
  return "";
}

/// A value that spoils a good scene, and what the message must hold.
struct BadOverride
{
  const char* override_text;
  const char* expected;
};
inline void PrintTo(const BadOverride& bad, std::ostream* out) { *out << bad.override_text; }

/// Steps with the scene's own inputs; every step must succeed.
inline void runSteps(Simulation& simulation, int steps)
{
  for (int k = 0; k < steps; ++k)
  {
    const StepReport report = simulation.step(simulation.defaultInputs());
    ASSERT_TRUE(report.ok) << report.message;
  }
}

}   // namespace slender::test
