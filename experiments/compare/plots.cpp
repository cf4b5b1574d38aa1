#include "plots.h"

#include <fmt/format.h>

#include <algorithm>

#include "gnuplot.h"
#include "offline/io/files/output_file.h"

namespace alces::offline {
namespace {

namespace fs = std::filesystem;

void write_text(const fs::path& path, const std::string& text) {
  OutputFile file(path);
  file.write(text);
  file.commit();
}

/// As gnuplot's variables want it: elch_lum.
std::string variable(std::string_view key) {
  std::string name(key);
  std::replace(name.begin(), name.end(), '+', '_');
  return name;
}

/// "'data/KIND-KEY.dat' using COLUMNS with lines lw 2 lc rgb color_KEY title 'TITLE'"
std::string curve(const std::string& kind, const CompareRow& row, const std::string& columns,
                  const std::string& style = "lines lw 2") {
  return fmt::format("'data/{}-{}.dat' using {} with {} lc rgb color_{} title '{}'", kind, row.key, columns,
                     style, variable(row.key), row.title);
}

std::string plot_command(const std::vector<std::string>& curves) {
  std::string command = "plot ";
  for (std::size_t i = 0; i < curves.size(); ++i) command += (i == 0 ? "" : ", \\\n     ") + curves[i];
  return command + "\n";
}

class Plotter {
 public:
  Plotter(const fs::path& out, const ExperimentResult& result, const ExperimentRequest& request,
          const std::string& gnuplot)
      : folder_(out / "plots"), result_(result), request_(request), gnuplot_(gnuplot) {
    make_folder(folder_ / "data");
    style();
  }

  void trajectories();
  void error_by_scan(bool post);
  void convergence(std::size_t watched);
  void run_time();
  void error_by_loops();

  [[nodiscard]] PlotReport report() && { return std::move(report_); }

 private:
  void style() const;
  void data(const std::string& name, const std::string& text) const {
    write_text(folder_ / "data" / (name + ".dat"), text);
  }
  /// Head, body; then the pictures.
  void figure(const std::string& name, int width, int height, const std::string& body);
  /// A figure that the experiment has no data for; one that an earlier experiment left there goes.
  void leave_out(const std::string& name, const char* why);
  [[nodiscard]] std::vector<const RowResult*> rows(bool post) const;

  fs::path folder_;
  const ExperimentResult& result_;
  const ExperimentRequest& request_;
  std::string gnuplot_;
  PlotReport report_;
};

void Plotter::style() const {
  std::string text =
      "# What all figures share. A figure sets name, width and height, then loads this file.\n"
      "# gnuplot NAME.gp draws NAME.svg; gnuplot -e \"format='png'\" NAME.gp draws NAME.png.\n"
      "if (!exists('format')) format = 'svg'\n"
      "if (format eq 'png') set terminal pngcairo size width,height font 'DejaVu Sans,11' noenhanced\n"
      "if (format eq 'svg') set terminal svg size width,height font 'DejaVu Sans,13' noenhanced background "
      "'white'\n"
      "set output name.'.'.format\n"
      "set grid lc rgb '#dddddd' lw 1 lt 1\n"
      "set border 3 lc rgb '#666666'\n"
      "set tics nomirror textcolor rgb '#333333'\n"
      "set key above samplen 2 width 2 textcolor rgb '#333333'\n"
      "set xrange [*:*] noextend\n"
      "color_truth = '#000000'\n";
  for (const CompareRow& row : compare_rows())
    text += fmt::format("color_{} = '{}'\n", variable(row.key), row.color);
  text +=
      "color_match = '#ffffff'\n"
      "color_loop = '#e8e8e8'\n"
      "color_relaxation = '#c8c8c8'\n";
  write_text(folder_ / "style.gp", text);
}

void Plotter::figure(const std::string& name, int width, int height, const std::string& body) {
  const std::string script = name + ".gp";
  write_text(folder_ / script, fmt::format("name = '{}'\nwidth = {}\nheight = {}\nload 'style.gp'\n{}", name,
                                           width, height, body));
  for (const PictureFormat format : {PictureFormat::svg, PictureFormat::png}) {
    const std::string problem = draw(gnuplot_, folder_, script, format);
    if (problem.empty())
      report_.pictures.push_back(folder_ / (name + (format == PictureFormat::png ? ".png" : ".svg")));
    else if (report_.problem.empty())
      report_.problem = problem;  // once said is enough
  }
}

void Plotter::leave_out(const std::string& name, const char* why) {
  report_.left_out.push_back(fmt::format("the figure {} is left out: {}", name, why));
  std::error_code ignored;
  for (const char* extension : {".gp", ".svg", ".png"}) fs::remove(folder_ / (name + extension), ignored);
}

std::vector<const RowResult*> Plotter::rows(bool post) const {
  std::vector<const RowResult*> chosen;
  for (const RowResult& row : result_.rows)
    if ((row.row.post != PostMethod::none) == post) chosen.push_back(&row);
  return chosen;
}

void Plotter::trajectories() {
  for (const RowResult& row : result_.rows) {
    const Pose truth_from_map =
        request_.truth ? request_.truth->truth_from_map(row.trajectory.poses, row.source_index) : Pose{};
    std::string text = "# stamp x_m y_m z_m\n";
    for (std::size_t i = 0; i < row.trajectory.size(); ++i) {
      const Eigen::Vector3d at = truth_from_map * row.trajectory.poses[i].translation_m;
      text +=
          fmt::format("{:.6f} {:.4f} {:.4f} {:.4f}\n", row.trajectory.stamps_s[i], at.x(), at.y(), at.z());
    }
    data(fmt::format("trajectory-{}", row.row.key), text);
  }
  if (request_.truth) {
    std::string text = "# scan x_m y_m z_m\n";
    for (std::size_t i = 0; i < request_.truth->truth_from_body.size(); ++i) {
      const auto& pose = request_.truth->truth_from_body[i];
      if (pose)
        text += fmt::format("{} {:.4f} {:.4f} {:.4f}\n", i, pose->translation_m.x(), pose->translation_m.y(),
                            pose->translation_m.z());
    }
    data("trajectory-truth", text);
  }
  const auto panel = [&](bool post, const char* title) -> std::string {
    std::vector<std::string> curves;
    for (const RowResult* row : rows(post))
      curves.push_back(curve("trajectory", row->row, "2:3", "lines lw 1.5"));
    if (curves.empty()) return "";
    if (request_.truth)
      curves.push_back(
          "'data/trajectory-truth.dat' using 2:3 with lines lw 1 dt 3 lc rgb color_truth title "
          "'ground truth'");
    return fmt::format("set title '{}'\n", title) + plot_command(curves);
  };
  const std::string online = panel(false, "loops closed while driving");
  const std::string post = panel(true, "with post-processing");
  const int panels = (online.empty() ? 0 : 1) + (post.empty() ? 0 : 1);
  if (panels == 0) return;
  figure("trajectories", 620 * panels, 680,
         fmt::format("set size ratio -1\nset xlabel 'x [m]'\nset ylabel 'y [m]'\nset multiplot layout 1,{}\n",
                     panels) +
             online + post + "unset multiplot\n");
}

void Plotter::error_by_scan(bool post) {
  std::vector<std::string> translation;
  std::vector<std::string> rotation;
  for (const RowResult* row : rows(post)) {
    if (!row->error) continue;
    std::string text = "# scan translation_m translation_xy_m arccos_q_qref_deg\n";
    for (std::size_t i = 0; i < row->error->scans.size(); ++i) {
      const ScanError& error = row->error->scans[i];
      text += fmt::format("{} {:.6f} {:.6f} {:.6f}\n", row->source_index[row->error_scans[i]],
                          error.translation_m, error.translation_xy_m, error.quaternion_angle_deg);
    }
    data(fmt::format("error-{}", row->row.key), text);
    translation.push_back(curve("error", row->row, "1:2", "lines lw 1.5"));
    rotation.push_back(curve("error", row->row, "1:4", "lines lw 1.5"));
  }
  if (translation.empty()) return;
  figure(
      post ? "error-by-scan-post" : "error-by-scan", 1000, 760,
      "set xlabel 'scan'\nset yrange [0:*]\nset multiplot layout 2,1\nset ylabel 'translation error [m]'\n" +
          plot_command(translation) + "set ylabel 'rotation error, arccos |q q_ref| [deg]'\n" +
          plot_command(rotation) + "unset multiplot\n");
}

// Bands behind a curve, one for every run of steps of one phase.
std::string bands(const std::vector<ConvergenceSample>& samples) {
  std::string text;
  for (std::size_t i = 0; i < samples.size();) {
    std::size_t end = i;
    while (end < samples.size() && samples[end].phase == samples[i].phase) ++end;
    const char* color = samples[i].phase == ConvergencePhase::match  ? "color_match"
                        : samples[i].phase == ConvergencePhase::loop ? "color_loop"
                                                                     : "color_relaxation";
    text += fmt::format(
        "set object rectangle from first {}, graph 0 to first {}, graph 1 behind fc rgb {} fs solid "
        "noborder\n",
        static_cast<double>(i) - 0.5, static_cast<double>(end) - 0.5, color);
    i = end;
  }
  return text;
}

void Plotter::convergence(std::size_t watched) {
  std::vector<std::string> translation;
  std::vector<std::string> rotation;
  const RowResult* shaded = nullptr;  // where all phases show: ELCH & LUM, else the last one
  std::size_t scan = 0;
  for (const RowResult& row : result_.rows) {
    if (watched >= row.watched.size() || row.watched[watched].samples.empty()) continue;
    scan = row.watched[watched].source_index;
    std::string text = "# step phase(0_match_1_loop_2_relaxation) translation_m arccos_q_qref_deg\n";
    for (const ConvergenceSample& sample : row.watched[watched].samples)
      text += fmt::format("{} {} {:.6f} {:.6f}\n", sample.step, static_cast<int>(sample.phase),
                          sample.translation_m, sample.quaternion_angle_deg);
    const std::string kind = fmt::format("convergence-{}", scan);
    data(fmt::format("{}-{}", kind, row.row.key), text);
    if (row.watched[watched].samples.size() < 2) continue;  // nothing has moved it
    const bool is_part_of_another =
        row.row.key == "elch" &&
        std::any_of(result_.rows.begin(), result_.rows.end(),
                    [](const RowResult& each) { return each.row.key == "elch+lum"; });
    if (row.row.key == "elch+lum" || shaded == nullptr || shaded->row.key != "elch+lum") shaded = &row;
    if (is_part_of_another || row.row.post == PostMethod::toro || row.row.post == PostMethod::hogman)
      continue;
    translation.push_back(curve(kind, row.row, "1:3", "steps lw 2"));
    rotation.push_back(curve(kind, row.row, "1:4", "steps lw 2"));
  }
  if (translation.empty()) return;
  const std::string kind = fmt::format("convergence-{}", scan);
  const std::vector<std::string> legend = {
      "keyentry with boxes fs solid fc rgb color_loop title 'loops'",
      "keyentry with boxes fs solid fc rgb color_relaxation title 'relaxation'"};
  const auto zoomed = [&](const char* columns) {
    std::vector<std::string> curves = {curve(kind, shaded->row, columns, "steps lw 2")};
    curves.insert(curves.end(), legend.begin(), legend.end());
    return plot_command(curves);
  };
  const std::string shade = bands(shaded->watched[watched].samples);
  figure(kind, 1200, 760,
         fmt::format("set xlabel 'step: a loop closed, or an iteration of the relaxation'\nset yrange "
                     "[0:*]\nset xrange [-0.5:*]\nset multiplot layout 2,2 columnsfirst title 'Convergence "
                     "of scan {}'\n",
                     scan) +
             "set ylabel 'translation error [m]'\n" + plot_command(translation) +
             "set ylabel 'rotation error, arccos |q q_ref| [deg]'\n" + plot_command(rotation) + shade +
             fmt::format("set xrange [-0.5:{}]\n",
                         static_cast<double>(shaded->watched[watched].samples.size()) - 0.5) +
             "set ylabel 'translation error [m]'\n" + zoomed("1:3") +
             "set ylabel 'rotation error, arccos |q q_ref| [deg]'\n" + zoomed("1:4") + "unset multiplot\n");
}

void Plotter::run_time() {
  constexpr double usual_floor_s = 0.001;
  double floor_s = usual_floor_s;  // the axis is logarithmic: all bars have to stand above it
  // gnuplot refuses a histogram that has no bar: such a column, and such a panel, is left out.
  const auto panel = [&](bool post, const char* title) -> std::string {
    const std::string name = post ? "run-time-post" : "run-time-online";
    std::string text = "# strategy front_end_s back_end_s\n";
    bool has_front = false;
    bool has_back = false;
    const auto number = [&](double time_s, bool& has_any) -> std::string {
      if (!(time_s > 0)) return "NaN";  // 0 has no logarithm, and no bar
      has_any = true;
      while (time_s <= floor_s) floor_s /= 10;
      return fmt::format("{:.9f}", time_s);
    };
    for (const RowResult* row : rows(post)) {
      const RowTimes& times = row->times;
      const double front_s = post ? times.post_front_end_s : times.online_front_end_s;
      const double back_s = post ? times.post_back_end_s : times.online_back_end_s;
      if (front_s <= 0 && back_s <= 0) continue;
      text +=
          fmt::format("\"{}\" {} {}\n", row->row.title, number(front_s, has_front), number(back_s, has_back));
    }
    if (!has_front && !has_back) return "";
    data(name, text);
    std::vector<std::string> bars;
    const std::string file = fmt::format("'data/{}.dat' using ", name);
    if (has_front) bars.push_back(file + "2:xtic(1) title 'front end' lc rgb '#56b4e9'");
    if (has_back) bars.push_back(file + "3:xtic(1) title 'back end' lc rgb '#d55e00'");
    return fmt::format("set title '{}'\n", title) + plot_command(bars);
  };
  const std::string online = panel(false, "while driving, without ICP");
  const std::string post = panel(true, "post-processing");
  const int panels = (online.empty() ? 0 : 1) + (post.empty() ? 0 : 1);
  if (panels == 0)
    return leave_out("run-time",
                     "no strategy closed a loop or relaxed the map, and ICP's time is not part of it");
  figure(
      "run-time", 560 * panels, 480,
      fmt::format("set style data histograms\nset style histogram clustered gap 1\nset style fill solid "
                  "noborder\nset logscale y\nset yrange [{}:*]\nset format y '%g'\nset ylabel 'run time [s], "
                  "logarithmic'\nset xtics rotate by -25\nset multiplot layout 1,{}\n",
                  floor_s, panels) +
          online + post + "unset multiplot\n");
}

void Plotter::error_by_loops() {
  std::vector<std::string> curves;
  for (const RowResult* row : rows(false)) {
    if (row->drive.empty()) continue;
    std::string text = "# scans loops_closed mean_translation_m mean_translation_xy_m\n";
    std::string loops = text;
    std::uint32_t closed = 0;
    for (const DriveSample& sample : row->drive) {
      const std::string line = fmt::format("{} {} {:.6f} {:.6f}\n", sample.scans, sample.loops_closed,
                                           sample.translation_m, sample.translation_xy_m);
      text += line;
      if (sample.loops_closed > closed) loops += line;
      closed = sample.loops_closed;
    }
    data(fmt::format("drive-{}", row->row.key), text);
    curves.push_back(curve("drive", row->row, "1:4", "lines lw 2"));
    if (closed == 0) continue;
    data(fmt::format("loops-{}", row->row.key), loops);
    curves.push_back(
        fmt::format("'data/loops-{}.dat' using 1:4 with points pt 7 ps 0.5 lc rgb color_{} notitle",
                    row->row.key, variable(row->row.key)));
  }
  if (curves.empty()) return;
  figure(
      "error-by-loops", 1000, 520,
      "set xlabel 'scans so far (dots: a loop closed)'\nset ylabel 'mean error in x and y so far [m]'\nset "
      "yrange [0:*]\n" +
          plot_command(curves));
}

}  // namespace

PlotReport write_plots(const fs::path& out, const ExperimentResult& result, const ExperimentRequest& request,
                       const std::string& gnuplot) {
  Plotter plotter(out, result, request, gnuplot);
  plotter.trajectories();
  plotter.error_by_scan(false);
  plotter.error_by_scan(true);
  std::size_t watched = 0;
  for (const RowResult& row : result.rows) watched = std::max(watched, row.watched.size());
  for (std::size_t i = 0; i < watched; ++i) plotter.convergence(i);
  plotter.run_time();
  plotter.error_by_loops();
  return std::move(plotter).report();
}

}  // namespace alces::offline
