// `study report` as a program: what is there is not done again, what fails is told, and the page needs nothing else.
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include "study/framework/whole_file.h"
#include "test/support/shell.h"

namespace {

namespace fs = std::filesystem;

using slender::test::Result;

std::size_t countOf(const std::string& text, const std::string& part)
{
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1))
    ++count;
  return count;
}

class Report : public testing::Test
{
protected:
  void SetUp() override
  {
    folder_ = testing::TempDir() + "/slender_sim_report_" + std::to_string(getpid());
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  Result report(const std::string& arguments, const std::string& environment = "") const
  {
    return slender::test::shell(environment + " " SLENDER_STUDY " report --quick --out " + folder_ + "/out " +
                                arguments);
  }
  std::string page() const { return slender::wholeFile(folder_ + "/out/report.html"); }

  std::string folder_;
};

TEST_F(Report, isOnePageWithFiguresAndTablesThatLoadsNothing)
{
  const Result made = report("trouton elastica");
  ASSERT_EQ(made.status, 0) << made.output;
  const std::string html = page();
  for (const char* study : {"trouton", "elastica"})
  {
    EXPECT_NE(html.find("<h3 id=\"" + std::string(study) + "\">"), std::string::npos);
    const fs::path data = folder_ + "/out/data/" + study;
    EXPECT_TRUE(fs::exists(data / (std::string(study) + ".csv")));
    // every picture of the study is in the page, whole
    for (const auto& file : fs::directory_iterator(data))
      if (file.path().extension() == ".png")
      {
        const std::string begin = "<img alt=\"" + file.path().stem().string() + "\" src=\"data:image/png;base64,iVBOR";
        const std::size_t at = html.find(begin);
        ASSERT_NE(at, std::string::npos) << file.path();
        const std::size_t start = html.find("base64,", at) + 7;
        EXPECT_EQ(html.find('"', start) - start, (fs::file_size(file.path()) + 2) / 3 * 4) << file.path();
      }
  }
  EXPECT_GE(countOf(html, "<img "), 1u);
  const std::string results = slender::wholeFile(folder_ + "/out/results.md");
  EXPECT_NE(results.find("| version | "), std::string::npos) << results;
  EXPECT_NE(results.find("**These are results of the quick form**"), std::string::npos);
  EXPECT_NE(html.find("worst_error_over_bound"), std::string::npos);
  EXPECT_NE(html.find("<td>processor</td>"), std::string::npos);
  // nothing is loaded: what refers to anything refers to the page itself
  const std::regex reference("(src|href)=(\"[^\"]{0,40}|[^\" >]{1,40})");
  for (auto match = std::sregex_iterator(html.begin(), html.end(), reference); match != std::sregex_iterator(); ++match)
    EXPECT_TRUE((*match)[2].str().rfind("\"data:image/png", 0) == 0 || (*match)[2].str().rfind("\"#", 0) == 0)
        << match->str();
  for (const char* loads : {"<link", "<script", "@import", "url("})
    EXPECT_EQ(html.find(loads), std::string::npos) << loads;
  // links lead somewhere
  const std::regex inside("href=\"#([^\"]*)\"");
  for (auto match = std::sregex_iterator(html.begin(), html.end(), inside); match != std::sregex_iterator(); ++match)
    EXPECT_TRUE(html.find("id=\"" + (*match)[1].str() + "\"") != std::string::npos ||
                html.find("id=" + (*match)[1].str() + ">") != std::string::npos)
        << match->str();
}

TEST_F(Report, goesOnWhereItWasStopped)
{
  ASSERT_EQ(report("trouton").status, 0);
  const fs::path result = folder_ + "/out/data/trouton/result.json";
  // A result that no run would give: if the study ran again it would be gone.
  const std::string mark =
      "{\"studies\": [{\"name\": \"trouton\", \"metrics\": {\"mark_of_the_test\": 42.5}, \"rows\": [], "
      "\"wall_seconds\": 1}]}\n";
  std::ofstream(result) << mark;
  const Result more = report("trouton elastica");
  ASSERT_EQ(more.status, 0) << more.output;
  EXPECT_NE(more.output.find("1 studies in"), std::string::npos) << more.output;
  EXPECT_EQ(slender::wholeFile(result), mark);
  EXPECT_NE(page().find("<td>mark_of_the_test</td><td class=n>42.5</td>"), std::string::npos);
  // killed while it was writing: a part of a result is none
  fs::rename(result, result.string() + ".part");
  ASSERT_EQ(report("trouton elastica").status, 0);
  EXPECT_EQ(page().find("mark_of_the_test"), std::string::npos);
  EXPECT_NE(slender::wholeFile(result).find("worst_error_over_bound"), std::string::npos);
}

TEST_F(Report, tellsWhichStudiesFailedAndWhy)
{
  // `lean` needs valgrind, which is not on this path
  fs::create_directories(folder_ + "/bin");
  for (const char* program : {"/bin/mv", "/usr/bin/gnuplot"})
    fs::create_symlink(program, folder_ + "/bin/" + fs::path(program).filename().string());
  const Result made = report("lean trouton", "PATH=" + folder_ + "/bin");
  EXPECT_EQ(made.status, 1) << made.output;
  EXPECT_NE(made.output.find("lean ended with exit status 1"), std::string::npos) << made.output;
  const std::string html = page();
  EXPECT_NE(html.find("<a href=\"#lean\">lean</a></td><td colspan=4 class=bad>failed</td>"), std::string::npos);
  EXPECT_NE(html.find("<p class=bad>failed: valgrind is missing"), std::string::npos);
  EXPECT_EQ(countOf(html, "class=bad>failed"), 2u) << "the other one has not failed";
  EXPECT_NE(html.find("<td class=n>at most 1</td><td class=good>met</td>"), std::string::npos)
      << "the bar of trouton's errors";
}

TEST_F(Report, namesTheVersionOfEachResult)
{
  ASSERT_EQ(report("trouton elastica").status, 0);
  std::ofstream(folder_ + "/out/data/trouton/version.txt") << "0.0.1, commit old";
  ASSERT_EQ(report("trouton elastica torsion").status, 0);
  for (const std::string& page : {page(), slender::wholeFile(folder_ + "/out/results.md")})
    EXPECT_NE(page.find("; 0.0.1, commit old: trouton"), std::string::npos) << page.substr(0, 3000);
}

TEST_F(Report, mixesNothingAndKnowsItsStudies)
{
  ASSERT_EQ(report("trouton").status, 0);
  const Result full = slender::test::shell(SLENDER_STUDY " report trouton --out " + folder_ + "/out");
  EXPECT_EQ(full.status, 2);
  EXPECT_NE(full.output.find("holds a report of another extent"), std::string::npos) << full.output;
  const Result unknown = report("trouton elastika");
  EXPECT_EQ(unknown.status, 2);
  EXPECT_NE(unknown.output.find("elastika"), std::string::npos) << unknown.output;
}

/// A report of four studies as files, written by hand: one that meets its targets, one that misses some, one whose
/// metric is not a number, and one that did not end.
class Results : public Report
{
protected:
  void SetUp() override
  {
    Report::SetUp();
    write("extent.txt", "full report\n");
    write("facts.txt", "version: 1.2.3, commit abc\nprocessor: a processor of the test\n");
    result("elastica", R"("worst_error_over_bound": 0.89)");
    // projection has two targets of its own; nan_count is that of every study
    result("projection", R"("length_error_max": 5e-9, "iterations_max_to_1ms": 7, "isotropic_over_general_cpu": 0.47,
      "nan_count": 2)");
    result("trouton", R"("worst_error_over_bound": null)");
    fs::create_directories(folder_ + "/out/data/torsion");
  }
  void write(const std::string& file, const std::string& text) const
  {
    fs::create_directories(fs::path(folder_ + "/out/data/" + file).parent_path());
    std::ofstream(folder_ + "/out/data/" + file) << text;
  }
  void result(const std::string& study, const std::string& metrics) const
  {
    write(study + "/result.json", "{\"studies\": [{\"name\": \"" + study + "\", \"metrics\": {" + metrics +
                                      "}, \"rows\": [], \"wall_seconds\": 1}]}\n");
  }
  /// Returns the first row of the page that has both texts.
  std::string row(const std::string& study, const std::string& text) const
  {
    std::istringstream lines(slender::wholeFile(folder_ + "/out/results.md"));
    for (std::string line; std::getline(lines, line);)
      if (line.rfind("| `" + study + "` |", 0) == 0 && line.find(text) != std::string::npos)
        return line;
    return "no row of " + study + " with " + text;
  }
  Result make() const { return slender::test::shell(SLENDER_STUDY " results " + folder_ + "/out"); }
};

TEST_F(Results, sayWhatIsMetMissedAndNotMeasured)
{
  const Result made = make();
  ASSERT_EQ(made.status, 0) << made.output;
  const auto has = [](const std::string& line, const std::string& text) {
    EXPECT_NE(line.find(text), std::string::npos) << line;
  };
  has(row("elastica", "elliptic integrals"), "| 0.89 of the bound | at most 1 of the bound; exact:");
  has(row("elastica", "elliptic integrals"), "| yes |");
  has(row("projection", "edge lengths"), "| 5e-9 | at most 1e-8 | yes |");
  has(row("projection", "iterations"), "| **7** | at most 5;");
  has(row("projection", "iterations"), "| no |");
  has(row("projection", "isotropic"), "| 0.47 |  | - |");
  // misses a target that has no headline: told all the same
  has(row("projection", "nan_count"), "| **2** | 0 | no |");
  // not a number is not met
  has(row("trouton", "stretched"), "| **not a number** |");
  has(row("trouton", "stretched"), "| no |");
  has(row("torsion", "gripper"), "| did not end | at most 1 of the bound;");
  has(row("torsion", "gripper"), "| - |");
  has(row("swing", "8 mm"), "| not in this report | at most 0.25 s (time);");
  has(row("swing", "8 mm"), "| - |");
  const std::string page = slender::wholeFile(folder_ + "/out/results.md");
  has(page, "Of 5 targets, **2 are met and 3 are missed**.");
  has(page, "`projection` (`iterations_max_to_1ms`)");
  has(page, "| version | 1.2.3, commit abc |");
  EXPECT_EQ(page.find("quick form**"), std::string::npos);
}

TEST_F(Results, sayIfTheyAreOfTheQuickForm)
{
  write("extent.txt", "quick report\n");
  result("coupled_safety", R"("penetrations": 0, "thickness_violations": 0, "nan_count": 0, "unexplained_failures": 0,
    "scenes": 20)");
  ASSERT_EQ(make().status, 0);
  const std::string page = slender::wholeFile(folder_ + "/out/results.md");
  EXPECT_NE(page.find("**These are results of the quick form**"), std::string::npos);
  // a target of the full form alone: a thousand scenes
  EXPECT_NE(row("coupled_safety", "stand behind").find("| not in the quick form | at least 1,000 (full form) | - |"),
            std::string::npos)
      << row("coupled_safety", "stand behind");
}

TEST_F(Results, fromABrokenOrAbsentReportAreNone)
{
  write("elastica/result.json", "{\"studies\": [");
  ASSERT_EQ(make().status, 0);
  EXPECT_NE(row("elastica", "the study itself").find("**failed**"), std::string::npos);
  EXPECT_NE(row("elastica", "elliptic").find("| **missing** |"), std::string::npos) << row("elastica", "elliptic");
  fs::remove(folder_ + "/out/data/extent.txt");
  const Result none = make();
  EXPECT_EQ(none.status, 2);
  EXPECT_NE(none.output.find("holds no report"), std::string::npos) << none.output;
}

}   // namespace
