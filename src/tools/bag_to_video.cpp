#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <future>
#include <iterator>
#include <optional>
#include <stdexcept>
#include <thread>
#include <tuple>

#include <fcntl.h>
#include <libyuv.h>

#include "arguments.h"
#include "export_program.h"
#include "holder_meshes.h"
#include "picture.h"
#include "video_file.h"
#include "study/framework/processes.h"

/// bag_to_video BAG --out FILE.mp4|FILE.gif: pictures of what was recorded, joined by ffmpeg.
namespace {

using slender::BadInput;
using slender::ObjectMesh;

const char* const name = "bag_to_video";
const char* const usage =
    "usage: bag_to_video BAG --out FILE.mp4|FILE.gif [options]\n"
    "  --fps N          frames per second of the video (default: mp4 25, gif 12.5)\n"
    "  --speed X        recorded seconds per second of the video (default 1)\n"
    "  --size WxH       of the picture in pixels, even numbers (default: mp4 1280x720, gif 640x360)\n"
    "  --from X,Y,Z     direction from what is seen to the eye (default 0.55,-1,0.45); the distance is such that all "
    "recorded motion is seen\n"
    "  --namespace NS   of the recorded topics, e.g. /rod_node; needed for a bag of several nodes\n"
    "  --scene-dir DIR  where the files lie that the recorded scene names (default: here); needed for bodies, "
    "obstacles, nozzles and floors\n"
    "  --quiet          print nothing but errors\n"
    "Exit status: 0 done, 2 bad input, 3 failed.\n";

struct VideoOptions
{
  std::optional<double> fps;
  double speed = 1.0;
  std::optional<std::pair<int, int>> size;
  Eigen::Vector3d from = slender::PictureView().from;
};

bool endsWith(const std::string& text, const std::string& end)
{
  return text.size() > end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

/// Joins pictures to a film; they go through a pipe. H.264 stores brightness and coarser colour (YUV 4:2:0), to which
/// libyuv converts ten times faster than ffmpeg.
class Ffmpeg
{
public:
  Ffmpeg(const std::string& file, bool gif, double fps, int width, int height)
    : file_(file),
      gif_(gif),
      width_(width),
      height_(height)
  {
    if (std::system("command -v ffmpeg >/dev/null") != 0)
      throw BadInput("ffmpeg is not installed; it joins the pictures: apt install ffmpeg");
    std::signal(SIGPIPE, SIG_IGN);   // told by fwrite
    char input[200];
    std::snprintf(input, sizeof input,
                  "ffmpeg -y -loglevel error -f rawvideo -pixel_format %s -video_size %dx%d -framerate %.9g -i - ",
                  gif ? "rgb24" : "yuv420p", width, height, fps);
    const std::string output =
        gif ? "-filter_complex "
              "'split[a][b];[a]palettegen=stats_mode=diff[p];[b][p]paletteuse=dither=bayer:bayer_scale=4' -f gif "
            : "-c:v libx264 -preset superfast -crf 18 -movflags +faststart -f mp4 ";
    pipe_ = popen((input + output + slender::shellWord(file)).c_str(), "w");
    if (!pipe_)
      throw std::runtime_error(std::string("ffmpeg cannot be started: ") + std::strerror(errno));
    constexpr int kPipeSize =
        1 << 20;   // [bytes]; with the usual 65536 the two processes wait for each other too often
    fcntl(fileno(pipe_), F_SETPIPE_SZ, kPipeSize);   // only faster: where it is not allowed, the size stays
    if (!gif)
      converted_.resize(static_cast<std::size_t>(width) * height * 3 / 2);
  }
  ~Ffmpeg()
  {
    if (pipe_)
      pclose(pipe_);
  }
  /// Rows from the top, red, green, blue per pixel.
  void add(const std::vector<std::uint8_t>& picture)
  {
    const std::vector<std::uint8_t>& bytes = gif_ ? picture : convert(picture);
    if (std::fwrite(bytes.data(), 1, bytes.size(), pipe_) != bytes.size())
      fail();
    ++pictures_;
  }
  void finish()
  {
    const int status = pclose(pipe_);
    pipe_ = nullptr;
    if (status != 0 || slender::picturesIn(file_) !=
                           pictures_)   // the status does not tell when the end of the file could not be written
      fail();
  }

private:
  [[noreturn]] void fail() const
  {
    throw std::runtime_error(std::string("ffmpeg failed to write the ") + (gif_ ? "gif" : "mp4") +
                             "; its message is above (is there room on the disk?)");
  }

  const std::vector<std::uint8_t>& convert(const std::vector<std::uint8_t>& picture)
  {
    std::uint8_t* const y = converted_.data();
    std::uint8_t* const u = y + static_cast<std::size_t>(width_) * height_;
    std::uint8_t* const v = u + static_cast<std::size_t>(width_) * height_ / 4;
    libyuv::RAWToI420(picture.data(), 3 * width_, y, width_, u, width_ / 2, v, width_ / 2, width_, height_);
    return converted_;
  }

  std::string file_;
  bool gif_;
  int width_, height_;
  std::vector<std::uint8_t> converted_;
  FILE* pipe_ = nullptr;
  long pictures_ = 0;
};

/// What a film shows: the box around it, and the eye that sees all of it.
struct Reach
{
  explicit Reach(const slender::PictureView& view) : eye(view.from, view.width, view.height) {}
  void add(const Eigen::Matrix3Xd& x, double radius = 0.0)
  {
    box.extend(Eigen::Vector3d(x.rowwise().minCoeff().array() - radius));
    box.extend(Eigen::Vector3d(x.rowwise().maxCoeff().array() + radius));
    eye.add(x, radius);
  }
  void add(const Reach& other)
  {
    box.extend(other.box);
    eye.add(other.eye);
  }

  Eigen::AlignedBox3d box;
  slender::EyeFinder eye;
};

/// A body or an obstacle: its surface, which does not change. Planes have no end and are left out.
Eigen::Matrix3Xd surfaceOf(const slender::Shape& shape)
{
  return std::holds_alternative<slender::Plane>(shape) ? Eigen::Matrix3Xd(3, 0) : slender::shapeMesh(shape).vertices;
}

void addSolid(const Eigen::Matrix3Xd& surface, const slender::Pose& X, Reach& to)
{
  if (surface.cols() > 0)
    to.add((X.orientation.toRotationMatrix() * surface).colwise() + X.position);
}

/// Places the camera: what the motion reaches is seen, with the obstacles that are no larger.
void placeCamera(const slender::ExportOptions& options, slender::PictureView& view)
{
  slender::BagReader bag(options.bag, options.topic_namespace, options.scene_folder);
  Reach motion(view);
  std::vector<Eigen::Matrix3Xd> bodies, obstacles;
  if (bag.scene())
  {
    for (const auto& body : bag.scene()->bodies)
      bodies.push_back(body.shape ? surfaceOf(*body.shape) : Eigen::Matrix3Xd(3, 0));
    for (const auto& obstacle : bag.scene()->obstacles)
      obstacles.push_back(surfaceOf(obstacle.shape));
  }
  std::vector<Reach> reached(obstacles.size(), Reach(view));
  slender::SceneSnapshot instant;
  while (bag.next(instant))
  {
    for (const slender::RodSnapshot& rod : instant.rods)
      motion.add(rod.x, std::max(rod.radius_a.maxCoeff(), rod.radius_b.maxCoeff()));
    for (const slender::ThreadSnapshot& thread : instant.threads)
      motion.add(thread.x, thread.radius.maxCoeff());
    for (const slender::ClothSnapshot& cloth : instant.cloths)
      motion.add(cloth.x);
    for (std::size_t b = 0; b < std::min(instant.bodies.size(), bodies.size()); ++b)
      addSolid(bodies[b], instant.bodies[b].pose, motion);
    for (std::size_t k = 0; k < std::min(instant.obstacles.size(), obstacles.size()); ++k)
      addSolid(obstacles[k], instant.obstacles[k].pose, reached[k]);
    for (const slender::ObjectMesh& holder : slender::holderMeshes(instant, bag.scene()))
      motion.add(holder.mesh.vertices);
  }
  if (motion.box.isEmpty())
    throw BadInput(options.bag + ": holds nothing that can be seen");
  const double size = motion.box.diagonal().norm();
  for (const Reach& obstacle : reached)
    if (!obstacle.box.isEmpty() && obstacle.box.diagonal().norm() <= size)
      motion.add(obstacle);
  view.box = motion.box;
  view.eye = motion.eye.eye();
}

/// Paints instants and hands the pictures over in their order. As many are painted at a time as there are processors.
class Film
{
public:
  Film(slender::BagReader& bag, const slender::PictureView& view, const slender::TubeResolution& resolution,
       Ffmpeg& ffmpeg)
    : bag_(bag),
      view_(view),
      resolution_(resolution),
      ffmpeg_(ffmpeg),
      painters_(std::clamp(std::thread::hardware_concurrency(), 1u, kMostPainters), slender::PicturePainter(view))
  {
  }
  void show(slender::SceneSnapshot instant)
  {
    if (pending_.size() == painters_.size())
      paint();
    pending_.push_back({std::move(instant), 1});
  }
  /// Shows the last instant for one picture more.
  void repeat() { ++pending_.back().pictures; }
  void finish() { paint(); }

private:
  static constexpr unsigned kMostPainters = 8;   // each takes 50 MB at 1280 x 720
  struct Pending
  {
    slender::SceneSnapshot instant;
    int pictures;
  };

  std::vector<ObjectMesh> meshesOf(const slender::SceneSnapshot& instant) const
  {
    std::vector<ObjectMesh> objects = slender::objectMeshes(instant, bag_.scene(), resolution_);
    const auto add = [&objects](std::vector<ObjectMesh> more) {
      std::move(more.begin(), more.end(), std::back_inserter(objects));
    };
    add(slender::holderMeshes(instant, bag_.scene()));
    if (bag_.scene())
      add(slender::planeMeshes(instant, *bag_.scene(), view_.box, view_.ground));
    return objects;
  }
  void paint()
  {
    std::vector<std::future<const std::vector<std::uint8_t>*>> pictures;
    for (std::size_t k = 0; k < pending_.size(); ++k)
      pictures.push_back(
          std::async(std::launch::async, [this, k] { return &painters_[k].paint(meshesOf(pending_[k].instant)); }));
    for (std::size_t k = 0; k < pending_.size(); ++k)
    {
      const std::vector<std::uint8_t>& picture = *pictures[k].get();
      for (int repeats = 0; repeats < pending_[k].pictures; ++repeats)
        ffmpeg_.add(picture);
    }
    pending_.clear();
  }

  slender::BagReader& bag_;
  const slender::PictureView& view_;
  const slender::TubeResolution& resolution_;
  Ffmpeg& ffmpeg_;
  std::vector<slender::PicturePainter> painters_;
  std::vector<Pending> pending_;
};

void run(const slender::ExportOptions& options, const VideoOptions& video)
{
  const bool gif = endsWith(options.out, ".gif");
  if (!gif && !endsWith(options.out, ".mp4"))
    throw BadInput("--out " + options.out + ": must end in .mp4 or .gif");
  slender::BagReader bag = slender::openBag(name, options, "bodies, obstacles, nozzles and floors are left out,");
  slender::PictureView view;
  std::tie(view.width, view.height) = video.size.value_or(gif ? std::pair(640, 360) : std::pair(1280, 720));
  view.from = video.from;
  placeCamera(options, view);
  view.ground = slender::groundOf(bag.scene());
  slender::TubeResolution resolution;
  view.tube_sides = resolution.sides;
  const double fps = video.fps.value_or(gif ? 12.5 : 25.0);
  if (gif && fps > 50)
    throw BadInput("--fps " + std::to_string(fps) +
                   ": a gif counts in hundredths of a second and has at most 50 pictures per second");
  slender::Staged file(slender::Staged::Kind::file, options.out);
  Ffmpeg ffmpeg(file.part(), gif, fps, view.width, view.height);

  Film film(bag, view, resolution, ffmpeg);

  slender::SceneSnapshot last;
  bool shown = false;   // `last`
  long frame = 0;
  const auto due = [&] { return static_cast<double>(frame) * video.speed / fps; };
  const auto show = [&] {   // what was recorded last, until there is something newer
    shown ? film.repeat() : film.show(last);
    shown = true;
    ++frame;
  };
  constexpr double rounding = 1e-7;   // [s]; stamps are rounded to 1e-9
  slender::eachInstant(name, options, bag, [&](const slender::SceneSnapshot& instant) {
    while (due() < bag.seconds() - rounding)
      show();
    last = instant;
    shown = false;
  });
  while (frame == 0 || due() <= bag.seconds() + rounding)
    show();
  film.finish();
  ffmpeg.finish();
  file.keep();
}

}   // namespace

int main(int argc, char** argv)
{
  VideoOptions video;
  const std::map<std::string, slender::OptionTaker> own = {
      {"--fps", [&](const std::string& option,
                    const std::string& value) { video.fps = slender::parsePositive(option, value, 1000); }},
      {"--speed", [&](const std::string& option,
                      const std::string& value) { video.speed = slender::parsePositive(option, value, 1e6); }},
      {"--size",
       [&](const std::string& option, const std::string& value) {
         const auto x = value.find('x');
         if (x == std::string::npos)
           throw BadInput(option + " " + value + ": must be like 1280x720");
         video.size = {slender::parseCount(option, value.substr(0, x), 16, 4096),
                       slender::parseCount(option, value.substr(x + 1), 16, 4096)};
         if (video.size->first % 2 || video.size->second % 2)
           throw BadInput(option + " " + value + ": must be even numbers, which videos need");
       }},
      {"--from",
       [&](const std::string& option, const std::string& value) {
         std::size_t at = 0;
         for (int k = 0; k < 3; ++k)
         {
           const std::size_t comma = k < 2 ? value.find(',', at) : value.size();
           if (comma == std::string::npos || !slender::parseNumber(value.substr(at, comma - at), video.from[k]))
             throw BadInput(option + " " + value + ": must be three numbers like 1,-1,0.5");
           at = comma + 1;
         }
         if (!(video.from.norm() > 1e-9))
           throw BadInput(option + " " + value + ": must not be zero");
       }},
  };
  return slender::exportProgram(name, usage, argc, argv, own,
                                [&](const slender::ExportOptions& options) { run(options, video); });
}
