// By its signature alone: is this a place that was seen before, and which? Each scan of a drive asks all
// scans that lie far enough back on the way; the one that is most alike is its answer. Answers are compared
// with where the scans were.
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <span>
#include <stdexcept>
#include <vector>

#include "alces/scan_signature.h"
#include "support.h"

namespace {

using namespace alces;
using namespace alces::bench;

constexpr double deg = std::numbers::pi / 180;

struct Options {
  std::string scans;
  std::string reference;
  std::uint64_t seed = 1;
  std::size_t town_scans = 924;
  double same_place_m = 5;
  double way_between_m = 40;
  float beside_m = 2.5F;
  std::vector<float> likenesses{0.50F, 0.55F, 0.60F, 0.65F, 0.70F};
};

struct Answer {
  float likeness = 0;
  double distance_m = 0;
  double yaw_off_rad = 0;
  bool has_revisit = false;  ///< one of the scans asked was taken at the same place
};

double yaw_rad(const Pose& pose) {
  const Eigen::Matrix3d axes = pose.rotation.toRotationMatrix();
  return std::atan2(axes(1, 0), axes(0, 0));
}

/// The scan as it was taken, and from so many places around.
std::vector<ScanSignature> seen_from_around(std::span<const Point> points, float beside_m) {
  std::vector<ScanSignature> signatures{ScanSignature::of(points)};
  if (beside_m <= 0) return signatures;
  for (const float x : {-beside_m, 0.0F, beside_m})
    for (const float y : {-beside_m, 0.0F, beside_m})
      if (x != 0 || y != 0) signatures.push_back(ScanSignature::of(points, x, y));
  return signatures;
}

struct Measured {
  std::vector<Answer> answers;
  Samples of_us;
  Samples ask_us;  ///< a scan asks one other, from all places around
};

Measured ask(const Drive& drive, const Options& options, float beside_m) {
  Measured measured;
  std::vector<ScanSignature> known;
  std::vector<double> way_m(drive.size, 0);
  for (std::size_t i = 1; i < drive.size; ++i)
    way_m[i] = way_m[i - 1] + (drive.truth[i].translation_m - drive.truth[i - 1].translation_m).norm();
  std::vector<Point> points;
  for (std::size_t i = 0; i < drive.size; ++i) {
    drive.points(i, points);
    const std::vector<Point> few = reduced(points, 0.1F);
    const Stopwatch making;
    known.push_back(ScanSignature::of(few));
    measured.of_us.add(1000 * making.ms());
    const std::vector<ScanSignature> asking = seen_from_around(few, beside_m);
    Answer answer;
    std::optional<std::size_t> best;
    float best_yaw_rad = 0;
    std::size_t asked = 0;
    const Stopwatch watch;
    for (std::size_t k = 0; k < i && way_m[k] <= way_m[i] - options.way_between_m; ++k, ++asked) {
      const double distance_m = (drive.truth[k].translation_m - drive.truth[i].translation_m).norm();
      answer.has_revisit = answer.has_revisit || distance_m < options.same_place_m;
      for (const ScanSignature& signature : asking) {
        if (known[k].likeness_bound(signature) <= answer.likeness) continue;
        std::array<YawCandidate, 1> candidate;
        if (known[k].correlate(signature, candidate) == 0 || candidate[0].likeness <= answer.likeness)
          continue;
        answer.likeness = candidate[0].likeness;
        answer.distance_m = distance_m;
        best_yaw_rad = candidate[0].yaw_rad;
        best = k;
      }
    }
    if (asked > 0) measured.ask_us.add(1000 * watch.ms() / static_cast<double>(asked));
    if (!best) continue;
    answer.yaw_off_rad = std::abs(std::remainder(
        yaw_rad(drive.truth[*best].inverse() * drive.truth[i]) - static_cast<double>(best_yaw_rad),
        2 * std::numbers::pi));
    measured.answers.push_back(answer);
  }
  return measured;
}

std::string percent(std::size_t part, std::size_t whole) {
  return whole == 0 ? "-"
                    : fmt::format("{} of {} ({:.0f} %)", part, whole,
                                  100.0 * static_cast<double>(part) / static_cast<double>(whole));
}

void print_rows(const Measured& measured, const Options& options, float beside_m) {
  const auto revisits =
      static_cast<std::size_t>(std::ranges::count_if(measured.answers, &Answer::has_revisit));
  for (const float least : options.likenesses) {
    std::size_t taken = 0;
    std::size_t right = 0;
    std::size_t near = 0;  // not the same place, but no more than twice as far
    Samples yaw_off_deg;
    for (const Answer& answer : measured.answers) {
      if (answer.likeness < least) continue;
      ++taken;
      if (answer.distance_m < 2 * options.same_place_m) ++near;
      if (answer.distance_m >= options.same_place_m) continue;
      ++right;
      yaw_off_deg.add(answer.yaw_off_rad / deg);
    }
    print_row({beside_m > 0 ? "9" : "1", fmt::format("{:.2f}", least), percent(right, taken),
               percent(near, taken), percent(right, revisits),
               fmt::format("{:.1f} / {:.1f}", yaw_off_deg.median(), yaw_off_deg.worst())});
  }
  fmt::print(
      "\n{} scans asked, {} of them at a place seen before; a signature {:.0f} us, a comparison {:.1f} "
      "us\n\n",
      measured.answers.size(), revisits, measured.of_us.median(), measured.ask_us.median());
}

void measure(const Options& options) {
  if (!options.scans.empty() && options.reference.empty())
    throw std::runtime_error("--reference says where the scans were; recorded scans need it");
  const Drive drive = options.scans.empty() ? town(options.seed, options.town_scans, 15000)
                                            : recorded(options.scans, SIZE_MAX, options.reference);
  print_heading("Places recognised by the signature: " + drive.name);
  print_header({"seen from", "likeness at least", "precision: within 5 m", "within 10 m", "recall",
                "yaw off, median / worst, deg"});
  for (const float beside_m : {0.0F, options.beside_m})
    print_rows(ask(drive, options, beside_m), options, beside_m);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Places recognised by the scans' signatures: how many, and how surely");
  Options options;
  app.add_option("SCANS", options.scans, "Folder of scans; without it: the synthetic town");
  app.add_option("--reference", options.reference, "Trajectory: where the scans were");
  app.add_option("--seed", options.seed, "Of the town")->capture_default_str();
  app.add_option("--scans", options.town_scans, "Of the town")->capture_default_str();
  app.add_option("--way", options.way_between_m, "Scans nearer on the way are not asked, m")
      ->capture_default_str();
  app.add_option("--beside", options.beside_m, "Between the nine places that a scan asks from, m")
      ->capture_default_str();
  app.add_option("--likeness", options.likenesses, "From here on an answer counts");
  return alces::bench::run(argc, argv, app, [&] { measure(options); });
}
