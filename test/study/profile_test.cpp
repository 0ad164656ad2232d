// What valgrind's tools write, read and told apart by source lines.
#include <sstream>
#include <stdexcept>

#include <gtest/gtest.h>

#include "study/framework/profile.h"

using namespace slender;
using namespace slender::study;

namespace {

const std::string sources = SLENDER_SOURCE_DIR;

TEST(Profile, pathsAreOfThePackageWhereverItWasBuilt)
{
  EXPECT_EQ(packagePath(sources, sources + "/src/contact/ccd.cpp"), "src/contact/ccd.cpp");
  EXPECT_EQ(packagePath(sources, "../src/contact/ccd.cpp"), "src/contact/ccd.cpp");
  EXPECT_EQ(packagePath(sources, "elsewhere/src/checkout/include/slender_sim/contact/ccd.h"),
            "include/slender_sim/contact/ccd.h");
  EXPECT_EQ(packagePath(sources, "/usr/src/linux/fork.c"), "/usr/src/linux/fork.c");
  EXPECT_EQ(packagePath(sources, "???"), "???");
}

TEST(Profile, instructionsOfLinesInlinedCodeAndCalls)
{
  std::istringstream file(
      "# callgrind format\npositions: line\nevents: Ir\nsummary: 1035\n\n"
      "ob=/lib/libslender_sim.so\nfl=../src/cloth/cloth_stepper.cpp\nfn=step\n"
      "10 20\n"
      "fi=../include/slender_sim/contact/friction.h\n7 5\n"
      "fe=../src/cloth/cloth_stepper.cpp\n11 10\n"
      "cob=/lib/libc.so.6\ncfi=./malloc/malloc.c\ncfn=malloc\ncalls=3 3281 \n12 900\n"
      "cfn=helper\ncalls=1 40\n13 100\n"
      "\nfn=helper\n40 100\n");
  StepProfile profile;
  readCallgrind(file, sources, profile);
  EXPECT_EQ(profile.instructions, 20u + 5 + 10 + 100) << "calls are the callees' own";
  ASSERT_EQ(profile.costs.size(), 6u);
  EXPECT_EQ(profile.costs[0].function, "step");
  EXPECT_EQ(profile.costs[0].at.file, "src/cloth/cloth_stepper.cpp");
  EXPECT_EQ(profile.costs[0].at.line, 10);
  EXPECT_EQ(profile.costs[1].at.file, "include/slender_sim/contact/friction.h");
  EXPECT_EQ(profile.costs[1].function_file, "src/cloth/cloth_stepper.cpp");
  EXPECT_EQ(profile.costs[3].callee, "malloc");
  EXPECT_EQ(profile.costs[3].callee_file, "./malloc/malloc.c");
  EXPECT_EQ(profile.costs[3].calls, 3u);
  EXPECT_EQ(profile.costs[3].instructions, 900u);
  EXPECT_EQ(profile.costs[4].callee, "helper");
  EXPECT_EQ(profile.costs[4].callee_file, "src/cloth/cloth_stepper.cpp") << "in the same file unless it says so";
  EXPECT_TRUE(profile.costs[5].callee.empty());
  std::istringstream other("events: Cycles\n1 2\n");
  EXPECT_THROW(readCallgrind(other, sources, profile), std::runtime_error);
}

TEST(Profile, allocationsWithTheirStacks)
{
  const std::vector<Allocation> all = readDhat(R"dhat({"dhatFileVersion":2,"mode":"heap",
    "pps":[{"tb":96,"tbk":2,"tl":5,"mb":48,"fs":[1,2,3]}],
    "ftbl":["[root]","0x48: operator new(unsigned long) (in /usr/lib/x.so)",
            "0x4B: slender::Simulation::step(slender::SceneInputs const&) (work/src/scene/simulation/simulation.cpp:120)","0x11: main (work/src/tools/simulate.cpp:5)"]})dhat",
                                               sources);
  ASSERT_EQ(all.size(), 1u);
  EXPECT_EQ(all[0].bytes, 96u);
  EXPECT_EQ(all[0].blocks, 2u);
  ASSERT_EQ(all[0].stack.size(), 3u);
  EXPECT_EQ(all[0].functions[0], "operator new(unsigned long)");
  EXPECT_EQ(all[0].stack[0].line, 0);
  EXPECT_EQ(all[0].stack[1].file, "src/scene/simulation/simulation.cpp");
  EXPECT_EQ(all[0].stack[1].line, 120);
  EXPECT_THROW(readDhat("{}", sources), std::runtime_error);
}

}   // namespace
