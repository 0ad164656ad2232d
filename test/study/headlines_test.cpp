// The lines of docs/results.md: every study has one, and their targets are the bars.
#include <cmath>
#include <limits>
#include <regex>
#include <set>

#include <gtest/gtest.h>

#include "slender_sim/study/headlines.h"
#include "test/support/special_numbers.h"

using namespace slender::study;

namespace {

using slender::test::kNan;

const Bar* barOf(const Headline& headline, const Figure& figure)
{
  return figure.from == Figure::From::metric ? findBar(headline.study, figure.key) : nullptr;
}

TEST(Headlines, everyStudyHasOne)
{
  std::set<std::string> with;
  for (const Headline& headline : headlines())
  {
    EXPECT_TRUE(findStudy(headline.study)) << headline.study;
    with.insert(headline.study);
  }
  for (const Study& study : studies())
    EXPECT_TRUE(with.count(study.name)) << study.name << " has no headline";
}

TEST(Headlines, sayInOneSentenceWhatTheFigureMeans)
{
  std::set<std::pair<std::string, std::string>> seen;
  for (const Headline& headline : headlines())
  {
    const std::string name = headline.study + ": " + headline.what;
    EXPECT_TRUE(seen.insert({headline.study, headline.what}).second) << name << " is there twice";
    EXPECT_FALSE(headline.figures.empty()) << name;
    ASSERT_FALSE(headline.meaning.empty()) << name;
    EXPECT_TRUE(std::isupper(headline.meaning.front()) || headline.meaning.front() == '`') << name;
    EXPECT_EQ(headline.meaning.find(". "), std::string::npos) << name << " has more than one sentence";
    EXPECT_EQ(headline.meaning.back(), '.') << name;
    for (const Figure& figure : headline.figures)
      EXPECT_EQ(figure.key.empty(), figure.from == Figure::From::relative_error) << name;
  }
}

// Bars of the full form belong to headlines that the quick form either has too, because the metric is there, or need
// not have. A bar that the quick form is judged by cannot be that of a headline which it does not have.
TEST(Headlines, ofTheFullFormHaveNoTargetThatTheQuickFormIsJudgedBy)
{
  for (const Headline& headline : headlines())
    for (const Figure& figure : headline.figures)
      if (const Bar* bar = barOf(headline, figure); bar && headline.form == Bar::Form::full)
      {
        EXPECT_TRUE(bar->form == Bar::Form::full || bar->kind == Bar::Kind::timing) << headline.study << figure.key;
      }
}

// A bar of a study of its own is worth a headline, else nobody reads it.
TEST(Headlines, everyBarOfAStudyIsATarget)
{
  for (const Bar& bar : bars())
  {
    bool found = bar.study.empty();
    for (const Headline& headline : headlines())
      for (const Figure& figure : headline.figures)
        found = found || (headline.study == bar.study && barOf(headline, figure) == &bar);
    EXPECT_TRUE(found) << bar.study << ", " << bar.metric << " is in no headline";
  }
}

// The target comes from the bar. Written again beside it, it would be forgotten when the bar changes.
TEST(Headlines, writeNoTargetTwice)
{
  for (const Headline& headline : headlines())
    for (const Figure& figure : headline.figures)
      if (const Bar* bar = barOf(headline, figure); bar && bar->limit != 0)
      {
        const std::string target = std::regex_replace(printedTarget(*bar, headline.unit), std::regex("^at \\w+ "), "");
        const std::regex again("(^|[^0-9.])" + std::regex_replace(target, std::regex("[.]"), "\\.") + "($|[^0-9.:])");
        for (const std::string& text : {headline.peer, headline.what, headline.meaning})
          EXPECT_FALSE(std::regex_search(text, again)) << headline.study << ": " << target << " in \"" << text << "\"";
      }
}

TEST(Headlines, figuresAreFoundInMetricsAndRows)
{
  StudyContext context("a study of the test", true, false);
  context.metric("error_a", 2.0);
  context.metric("error_b", 3.0);
  context.metric("other", kNan);
  context.row().set("case", "one").set("speed", 4.0).set("measured", 1.1).set("expected", 1.0);
  context.row().set("case", "two").set("speed", 5.0).set("measured", 1.4).set("expected", 2.0);
  context.row().set("speed", 6.0);
  const ResultValues result{context.metrics(), context.rows()};
  const auto expect = [&](const Figure& figure, double least, double most) {
    const FigureValue value = valueOf(figure, result);
    EXPECT_TRUE(value.found);
    EXPECT_NEAR(value.least, least, 1e-12);
    EXPECT_NEAR(value.most, most, 1e-12);
  };
  using From = Figure::From;
  expect({"error_*"}, 2, 3);
  expect({"speed", "", From::rows}, 4, 6);
  expect({"speed", "", From::rows, "case", "one"}, 4, 4);
  expect({"speed", "", From::rows, "case", "one", true}, 5, 5);
  expect({"", "", From::relative_error, "case", "two"}, 0.3, 0.3);
  EXPECT_FALSE(valueOf({"error"}, result).found);
  EXPECT_FALSE(valueOf({"speed", "", From::rows, "case", "three"}, result).found);
  EXPECT_TRUE(std::isnan(valueOf({"other"}, result).most));
}

TEST(Headlines, missingFiguresAreTold)
{
  for (const bool quick : {true, false})
  {
    StudyContext context("helical_scene", quick, false);
    context.metric("worst_peak_error", 0.001);
    const std::vector<std::string> missing = missingFigures(context);
    // of the full form: frames_matter and tangent_peak_error
    ASSERT_EQ(missing.size(), quick ? 1u : 3u);
    EXPECT_NE(missing.front().find("worst_moment_error"), std::string::npos) << missing.front();
  }
}

TEST(Headlines, numbersAreRoundedAndGrouped)
{
  EXPECT_EQ(printed(1114.2, {1, " times", 2}), "1,114 times");
  EXPECT_EQ(printed(0.00126, kPercent), "0.13 %");
  EXPECT_EQ(printed(-0.34, kPercent), "-34 %");
  EXPECT_EQ(printed(1234567.0, kCount), "1,234,567");
  EXPECT_EQ(printed(0.0, kNumber), "0");
  EXPECT_EQ(printed(6.3e-15, {1, "", 1}), "6e-15");
  EXPECT_EQ(printed(kNan, kPercent), "not a number");
  const Bar most{"", "m", Bar::Sense::at_most, 0.25}, least{"", "m", Bar::Sense::at_least, 1e4};
  EXPECT_EQ(printedTarget(most, kPercent), "at most 25 %");
  EXPECT_EQ(printedTarget(least, kTimes), "at least 10,000 times");
  EXPECT_EQ(printedTarget({"", "m", Bar::Sense::at_most, 1e-9}, kNumber), "at most 1e-9");
  EXPECT_EQ(printedTarget({"", "m", Bar::Sense::at_most, 1.5e-9}, kNumber), "at most 1.5e-9");
  // 25 % would look met
  EXPECT_EQ(printed(0.2504, kPercent, most), "25.04 %");
  EXPECT_EQ(printed(0.2496, kPercent, most), "25 %");
}

}   // namespace
