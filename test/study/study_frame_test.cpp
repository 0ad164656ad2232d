#include <cmath>
#include <sstream>
#include <stdexcept>

#include <gtest/gtest.h>

#include "slender_sim/study/bars.h"
#include "slender_sim/study/output.h"
#include "slender_sim/study/reference.h"
#include "slender_sim/study/study.h"
#include "test/support/special_numbers.h"

using namespace slender::study;

namespace {

using slender::test::kNan;

double metric(const StudyContext& context, const std::string& key)
{
  for (const auto& m : context.metrics())
    if (m.first == key)
      return m.second;
  throw std::out_of_range(key);
}

TEST(StudyFrame, worstErrorIsTheLargestOverItsBound)
{
  StudyContext context("frame", true, false);
  context.row().set("n", 1).check(1.01, 1.0, 0.1, "formula");
  context.row().check(0.8, 1.0, 0.4, "formula");
  context.row().set("remark", "no check");
  context.finish();
  EXPECT_NEAR(metric(context, "worst_error_over_bound"), 0.5, 1e-12);
}

TEST(StudyFrame, casesAreChosenByNumbersAndRanges)
{
  EXPECT_EQ(parseCases("7,12,20-22"), (std::vector<int>{7, 12, 20, 21, 22}));
  for (const char* bad : {"", "7,", "a", "-3", "5-", "9-8", "1.5", "1 2", "99999999"})
    EXPECT_THROW(parseCases(bad), std::invalid_argument) << bad;

  StudyContext context("frame", true, false);
  EXPECT_EQ(context.cases(3), (std::vector<int>{0, 1, 2}));
  context.choose({766, 2});
  EXPECT_EQ(context.cases(3), (std::vector<int>{766, 2}));
}

TEST(StudyFrame, onlyTheChosenScenesOfASafetyStudyRun)
{
  const Study* study = findStudy("coupled_safety");
  ASSERT_TRUE(study && study->numbered);
  StudyContext context(study->name, true, false);
  context.choose({5});
  study->run(context);
  ASSERT_EQ(context.rows().size(), 1u);
  EXPECT_EQ(std::get<double>(*context.rows().front().find("scene")), 5.0);
  EXPECT_EQ(metric(context, "scenes"), 1.0);
}

/// In these scenes a ball presses on held corners while threads divide (417), a rope folds (469), and things that are
/// thrown got around the rim of a sheet in one step (772, 881).
TEST(StudyFrame, scenesWithFoldsAndRimsHold)
{
  const Study* study = findStudy("coupled_safety");
  ASSERT_TRUE(study);
  StudyContext context(study->name, true, false);
  context.choose({56, 352, 417, 469, 569, 772, 881});
  study->run(context);
  for (const char* name : {"penetrations", "thickness_violations", "refused"})
    EXPECT_EQ(metric(context, name), 0.0) << name;
}

TEST(StudyFrame, aCheckWithoutANumberIsNoSuccess)
{
  StudyContext context("frame", true, false);
  context.row().check(kNan, 1.0, 0.1, "formula");
  context.row().check(1.0, 1.0, 0.1, "formula");
  context.finish();
  EXPECT_TRUE(std::isnan(metric(context, "worst_error_over_bound")));
}

TEST(StudyFrame, noChecksNoMetric)
{
  StudyContext context("frame", true, false);
  context.row().set("n", 1);
  context.finish();
  EXPECT_TRUE(context.metrics().empty());
}

TEST(StudyFrame, judgingFindsEveryFailure)
{
  StudyContext good("projection", true, false);
  good.row().check(1.0, 1.0, 0.1, "formula");
  good.metric("length_error_max", 1e-9);
  good.metric("iterations_max_to_1ms", 3);
  EXPECT_TRUE(judge(good).empty());

  StudyContext bad("projection", true, false);
  bad.row().check(1.2, 1.0, 0.1, "formula of the test");
  bad.row().check(kNan, 1.0, 0.1, "formula");
  bad.metric("length_error_max", kNan);
  const std::vector<std::string> failures = judge(bad);
  ASSERT_EQ(failures.size(), 4u) << "two rows, a metric that is not a number, a metric that is missing";
  EXPECT_NE(failures[0].find("formula of the test"), std::string::npos) << failures[0];
  EXPECT_NE(failures[2].find("length_error_max"), std::string::npos) << failures[2];
  EXPECT_NE(failures[3].find("iterations_max_to_1ms has a bar but is missing"), std::string::npos) << failures[3];
}

TEST(StudyFrame, judgingLeavesTimingsOutAndRefusesStudiesThatCannotFail)
{
  StudyContext timed("rod_scaling", true, false);
  timed.metric("iterations_per_step_worst", 2.0);
  timed.metric("microseconds_per_node_iteration", 1e3);   // far beyond its bar
  EXPECT_TRUE(judge(timed).empty());
  StudyContext empty("a study of the test", true, false);
  empty.metric("seconds", 1.0);
  ASSERT_EQ(judge(empty).size(), 1u);
  EXPECT_NE(judge(empty)[0].find("nothing in it can fail"), std::string::npos);
}

TEST(StudyFrame, barsOfTheFullFormAreNotAskedOfTheQuickForm)
{
  for (const bool quick : {true, false})
  {
    StudyContext context("helical_buckling", quick, false);
    context.row().check(1.0, 1.0, 0.1, "formula");
    EXPECT_EQ(judge(context).size(), quick ? 0u : 1u);
  }
}

TEST(StudyFrame, everyBarOfAStudyNamesAStudy)
{
  for (const Bar& bar : bars())
    EXPECT_TRUE(bar.study.empty() || findStudy(bar.study)) << bar.study;
  EXPECT_TRUE(findBar("cloth_accuracy", "observed_order_tr_bdf2_flag"));
  EXPECT_FALSE(findBar("cloth_accuracy", "observed_order_flag"));
}

TEST(StudyFrame, boundMustBePositive)
{
  Row row;
  for (const double bound : {0.0, -1.0, kNan})
    EXPECT_THROW(row.check(1, 1, bound, "formula"), std::invalid_argument) << bound;
}

TEST(StudyFrame, jsonHasNullForWhatIsNotFinite)
{
  StudyContext context("fra\"me", true, false);
  context.metric("m", kNan);
  context.row().set("a", std::numeric_limits<double>::infinity()).set("b", 0.1).set("c", "two\nlines");
  std::ostringstream out;
  writeJson(out, {{&context, 1.5, "broke"}});
  const std::string text = out.str();
  EXPECT_NE(text.find("\"m\": null"), std::string::npos) << text;
  EXPECT_NE(text.find("{\"a\": null, \"b\": 0.1, \"c\": \"two\\nlines\"}"), std::string::npos) << text;
  EXPECT_NE(text.find("\"name\": \"fra\\\"me\""), std::string::npos) << text;
  EXPECT_NE(text.find("\"error\": \"broke\""), std::string::npos) << text;
  EXPECT_NE(text.find("\"wall_seconds\": 1.5"), std::string::npos) << text;
}

TEST(StudyFrame, csvHasTheUnionOfKeys)
{
  StudyContext context("frame", true, false);
  context.row().set("a", 1).set("c", "x,y");
  context.row().set("a", 2).set("b", 3);
  std::ostringstream out;
  writeCsv(out, context);
  EXPECT_EQ(out.str(), "a,b,c\n1,,\"x,y\"\n2,3,\n");
}

TEST(StudyFrame, everyStudyCanBeFound)
{
  ASSERT_FALSE(studies().empty());
  for (const Study& s : studies())
    EXPECT_EQ(findStudy(s.name), &s);
  EXPECT_EQ(findStudy("no such study"), nullptr);
}

// The small-load and large-load limits of the heavy cantilever, exact to the next order in Gamma (Gamma^2) and
// Gamma^(-1/2).
TEST(References, heavyCantileverLimits)
{
  const CantileverTip light = heavyCantilever(1e-3), heavy = heavyCantilever(1e5);
  EXPECT_NEAR(light.drop / light.extent / (1e-3 / 8), 1.0, 1e-6);
  EXPECT_NEAR(heavy.drop / heavy.extent / std::sqrt(1e5 / 2), 1.0, 0.01);
}

// Hanging in its own weight a rod stretches by stretch/2 of its length: approached by the drop of a very flexible one.
TEST(References, heavyCantileverStretches)
{
  const CantileverTip stiff = heavyCantilever(1e5), soft = heavyCantilever(1e5, 0.01);
  EXPECT_NEAR(soft.drop - stiff.drop, 0.005, 1e-4);
}

// pi^2 and 4 pi^2: Euler's loads, 1 + compression/2 of them shortly after buckling (Taylor series of the elliptic
// integrals).
TEST(References, bucklingLoads)
{
  EXPECT_NEAR(bucklingElastica(1e-3, false).load / (M_PI * M_PI), 1 + 0.5e-3, 1e-6);
  EXPECT_NEAR(bucklingElastica(1e-3, true).load / (4 * M_PI * M_PI), 1 + 0.5e-3, 1e-6);
}

// Table I of Bisshopp and Drucker, and the linear beam P L^3/(3 E I).
TEST(References, endLoadedCantilever)
{
  EXPECT_NEAR(endLoadedCantilever(1e-3).drop / (1e-3 / 3), 1.0, 1e-5);
  EXPECT_NEAR(endLoadedCantilever(1.0).drop, 0.30172, 1e-5);
  EXPECT_NEAR(endLoadedCantilever(10.0).drop, 0.81061, 1e-5);
}

// Published roots, e.g. Timoshenko, Vibration Problems in Engineering.
TEST(References, cantileverRoots)
{
  EXPECT_NEAR(cantileverRoot(1), 1.875104069, 1e-9);
  EXPECT_NEAR(cantileverRoot(4), 10.99554073, 1e-8);
  for (int mode = 1; mode <= 4; ++mode)
  {
    EXPECT_NEAR(std::abs(cantileverMode(mode, 1.0)), 2.0, 1e-6);
    const double h = 1e-5;
    EXPECT_NEAR(cantileverModeSlope(mode, 0.7),
                (cantileverMode(mode, 0.7 + h) - cantileverMode(mode, 0.7 - h)) / (2 * h), 1e-5);
  }
}

}   // namespace
