#pragma once

#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "test/support/shell.h"

/// Programs run as a user runs them.
namespace slender {

namespace fs = std::filesystem;
using test::Result;
using test::shell;

inline std::string contentsOf(const fs::path& path)
{
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

inline std::set<std::string> namesIn(const fs::path& folder)
{
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder))
    names.insert(entry.path().filename().string());
  return names;
}

inline const std::string source = SLENDER_SOURCE_DIR;
inline const std::string csv = SLENDER_BAG_TO_CSV, mesh = SLENDER_BAG_TO_MESH, video = SLENDER_BAG_TO_VIDEO;

class Exports : public testing::Test
{
protected:
  void SetUp() override
  {
    folder_ = testing::TempDir() + "slender_sim_exports_" + std::to_string(getpid());
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string path(const std::string& name) const { return folder_ + "/" + name; }

  /// The bag; `options` may ask for tables of the same run.
  std::string record(const std::string& scene, const std::string& options)
  {
    const std::string bag = path(scene + ".bag");
    const Result result = shell(std::string(SLENDER_SIMULATE) + " " + source + "/config/scenes/" + scene +
                                ".yaml --quiet --bag " + bag + " " + options);
    EXPECT_EQ(result.status, 0) << result.output;
    return bag;
  }

  void expectExported(const std::string& command)
  {
    const Result result = shell(command);
    EXPECT_EQ(result.status, 0) << command << "\n" << result.output;
  }

  std::string folder_;
};

}   // namespace slender
