#include "export_program.h"

#include <cstdio>
#include <exception>
#include <filesystem>
#include <optional>

#include "arguments.h"
#include "study/framework/processes.h"
#include "slender_sim/scene/file_paths.h"

namespace slender {

namespace fs = std::filesystem;

int exportProgram(const std::string& name, const std::string& usage, int argc, char** argv,
                  const std::map<std::string, OptionTaker>& own, const std::function<void(const ExportOptions&)>& run)
{
  constexpr int exit_done = 0, exit_bad_input = 2, exit_failed = 3;
  ExportOptions options;
  std::map<std::string, OptionTaker> takers = own;
  takers["--out"] = [&](const std::string&, const std::string& value) { options.out = value; };
  takers["--namespace"] = [&](const std::string&, const std::string& value) { options.topic_namespace = value; };
  takers["--scene-dir"] = [&](const std::string&, const std::string& value) { options.scene_folder = value; };
  try
  {
    for (int k = 1; k < argc; ++k)
    {
      const std::string argument = argv[k];
      if (argument == "--help" || argument == "-h")
      {
        std::fputs(usage.c_str(), stdout);
        return exit_done;
      }
      const auto taker = takers.find(argument);
      if (taker != takers.end())
      {
        if (k + 1 >= argc)
          throw BadInput(argument + ": its value is missing\n" + usage);
        taker->second(argument, argv[++k]);
      }
      else if (argument == "--quiet")
        options.quiet = true;
      else if (argument.size() > 1 && argument[0] == '-')
        throw BadInput(argument + ": unknown option\n" + usage);
      else if (!options.bag.empty())
        throw BadInput(argument + ": only one bag can be exported\n" + usage);
      else
        options.bag = argument;
    }
    if (options.bag.empty())
      throw BadInput("a bag is missing\n" + usage);
    if (options.out.empty())
      throw BadInput("--out is missing\n" + usage);
    run(options);
    return exit_done;
  }
  catch (const BadInput& error)
  {
    std::fprintf(stderr, "%s: %s\n", name.c_str(), error.what());
    return exit_bad_input;
  }
  catch (const BagError& error)
  {
    std::fprintf(stderr, "%s: %s\n", name.c_str(), error.what());
    return exit_bad_input;
  }
  catch (const std::invalid_argument& error)   // a recording that lacks something
  {
    std::fprintf(stderr, "%s: %s\n", name.c_str(), error.what());
    return exit_bad_input;
  }
  catch (const std::exception& error)
  {
    std::fprintf(stderr, "%s: %s\n", name.c_str(), error.what());
    return exit_failed;
  }
}

BagReader openBag(const std::string& program, const ExportOptions& options, const std::string& loses)
{
  BagReader bag(options.bag, options.topic_namespace, options.scene_folder);
  if (!bag.scene() && !options.quiet)
    std::fprintf(stderr, "%s: %s without the recorded scene (--scene-dir: where the files lie that it names): %s\n",
                 program.c_str(), loses.c_str(), bag.sceneProblem().c_str());
  return bag;
}

void eachInstant(const std::string& program, const ExportOptions& options, BagReader& bag,
                 const std::function<void(const SceneSnapshot&)>& use)
{
  std::optional<Progress> progress;
  if (!options.quiet)
    progress.emplace(program, "messages", bag.messages());
  SceneSnapshot instant;
  while (bag.next(instant))
  {
    use(instant);
    if (progress)
      progress->show(bag.done());
  }
  const std::string gaps = bag.gaps();
  if (!gaps.empty() && !options.quiet)
    std::fprintf(stderr, "%s: warning: %s: %s\n", program.c_str(), options.bag.c_str(), gaps.c_str());
}

bool FrameChoice::takes(double seconds)
{
  if (fps_ <= 0)
    return true;
  const double due = static_cast<double>(next_) / fps_;
  if (seconds < due - 1e-7)   // stamps are rounded to 1e-9 s
    return false;
  next_ = static_cast<long>((seconds + 1e-7) * fps_) + 1;
  return true;
}

Staged::Staged(Kind kind, std::string path) : path_(std::move(path))
{
  while (path_.size() > 1 && path_.back() == '/')
    path_.pop_back();
  part_ = path_ + ".part";
  std::error_code error;
  if (kind == Kind::folder)
  {
    if (fs::exists(path_) && !(fs::is_directory(path_) && fs::is_empty(path_, error)))
      throw BadInput("--out " + path_ + ": exists and is not an empty folder; name another, or empty it first");
    fs::remove_all(part_, error);   // of a run that was killed
    fs::create_directories(part_, error);
    if (!fs::is_directory(part_))
      throw BadInput("--out " + path_ + ": cannot be made a folder: " + error.message());
    return;
  }
  try
  {
    path_ = replaceablePath(path_);
    part_ = path_ + ".part";
  }
  catch (const std::runtime_error& problem)
  {
    throw BadInput("--out " + std::string(problem.what()));
  }
  const fs::path parent = fs::path(path_).parent_path();
  if (!parent.empty() && !fs::is_directory(parent))
    throw BadInput("--out " + path_ + ": there is no folder " + parent.string() + "; make it first");
}

Staged::~Staged()
{
  std::error_code error;
  if (!kept_)
    fs::remove_all(part_, error);
}

void Staged::keep()
{
  std::error_code error;
  fs::rename(part_, path_, error);   // takes the place of an empty folder, or of a file
  if (error)
    throw std::runtime_error(path_ + ": cannot be renamed from " + part_ + ": " + error.message());
  kept_ = true;
}

}   // namespace slender
