#include <tools/cli/build_command.h>

#include <tools/cli/cli.h>
#include <tools/cli/trace_device.h>
#include <tools/render/studio/shutter.h>

#include <algorithm>
#include <cctype>
#include <string_view>
#include <utility>

namespace hiprt::tools {
namespace {

/// In any case.
bool ends_with(std::string name, std::string_view ending) {
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return name.ends_with(ending);
}

void add_file_options(CLI::App& app, BuildCommand& command) {
  app.add_option("INPUT", command.inputs,
                 "Files of meshes or shapes, one geometry each; or one scene of instances, .json or .scene; with "
                 "--refit a BVH file")
      ->required()
      ->type_name("FILE");
  app.add_option("-o,--output", command.output, "The BVH file to write")->required()->type_name("FILE");
}

void add_builder_options(CLI::App& app, BuildCommand& command) {
  app.add_option(
         "--builder", command.builder,
         "How the tree is built: lbvh is built fastest, hq gives the fastest rays; lbvh30 and ploc are there to "
         "compare with, embree-* are Embree's")
      ->check(CLI::IsMember(words(kBuilders)))
      ->type_name("NAME")
      ->capture_default_str();
  app.add_option("--quality", command.quality,
                 "Chooses the builder and its options. fast: lbvh, the fastest build; balanced: hploc, little slower, "
                 "with faster rays; high: hq, the fastest rays. Not together with --builder")
      ->check(CLI::IsMember(words(kQualities)))
      ->type_name("WORD")
      ->excludes("--builder");
  app.add_option("--import", command.imported,
                 "Take the tree of this JSON file (bvhinfo --export writes such files) in place of a builder's")
      ->type_name("FILE")
      ->excludes("--builder")
      ->excludes("--quality");
}

void add_target_options(CLI::App& app, BuildCommand& command) {
  app.add_option(
         "--nodes", command.nodes,
         "Layout of the nodes; auto: the one for --target. half and quantized have nodes of half the size, with "
         "boxes that are rounded outwards")
      ->check(CLI::IsMember(words(kLayouts, {"auto"})))
      ->type_name("NAME")
      ->capture_default_str();
  app.add_option("--target", command.target, "Machine to trace on (cpu and nvidia: planes, amd: float)")
      ->check(CLI::IsMember(words(kTargetLayouts)))
      ->type_name("NAME")
      ->capture_default_str();
  app.add_option(
         "--device", command.device,
         "What builds. gpu: all but embree-* and --import, by default hploc. auto: the GPU if there is one and it has "
         "the builder")
      ->check(CLI::IsMember(words(kDeviceChoices)))
      ->type_name("NAME")
      ->capture_default_str();
  add_threads_option(app, command.threads);
}

void add_tree_options(CLI::App& app, BuildCommand& command) {
  app.add_option("--max-leaf", command.max_leaf, "Most triangles below one leaf reference, 1 to 64")
      ->check(CLI::Range(1u, 64u))
      ->type_name("N")
      ->capture_default_str();
  app.add_option(
         "--split-budget", command.split_budget,
         "References that sbvh, hq and embree-high may make of one on the way down, on average, 1 to 16 (default: "
         "3 for hq, 1.5 for the others)")
      ->check(CLI::Range(1.0, 16.0))
      ->type_name("X");
  app.add_option("--presplit-budget", command.presplit_budget,
                 "References that may be made of one by cuts before there is a tree, on average, 1 to 16. For hploc "
                 "with rounds of reinsertion")
      ->check(CLI::Range(1.0, 16.0))
      ->type_name("X")
      ->capture_default_str();
  app.add_option(
         "--reinsertion-rounds", command.rounds,
         "How often to look for better places for an eighth of the tree's nodes, 0 to 1000 (default: 32 for hq, "
         "0 for others, or what goes with --quality)")
      ->check(CLI::Range(0u, 1000u))
      ->type_name("N");
  app.add_option("--ploc-radius", command.ploc_radius, "How far ploc and hploc look for the nearest cluster, 1 to 128")
      ->check(CLI::Range(1u, 128u))
      ->type_name("N")
      ->capture_default_str();
  app.add_flag("--no-pairs", command.no_pairs, "Do not put two triangles that share an edge into one leaf")
      ->disable_flag_override();
  app.add_flag("--stats", command.stats, "Print figures of the tree, times and memory")->disable_flag_override();
}

void add_scene_options(CLI::App& app, BuildCommand& command) {
  app.add_flag("--instances", command.instances,
               "Make a scene of instances: every glTF mesh is one object, its nodes are instances of it; every other "
               "file is an object with one instance")
      ->disable_flag_override();
  app.add_flag("--flatten", command.flatten,
               "Build one BVH without instances over the scene: every instance of a mesh becomes a geometry, with its "
               "triangles where the scene has them")
      ->disable_flag_override();
  app.add_option(
         "--opening-budget", command.opening_budget,
         "Leaves that trees over instances may have per instance, 1 to 64 on average: the largest instances are "
         "opened, and rays enter parts of their objects. For instances that overlap")
      ->check(CLI::Range(1.0, 64.0))
      ->type_name("X")
      ->excludes("--flatten")
      ->capture_default_str();
  app.add_option(
         "--levels", command.levels,
         "Levels of instances that may be left, 1 to 4096: groups beyond them give way to the instances that they "
         "have, which makes rays faster and files larger. What moves stays (default: as described)")
      ->check(CLI::Range(1u, 4096u))
      ->type_name("N")
      ->excludes("--flatten");
  app.add_option("--shutter", command.shutter,
                 "With --instances: read the animations of glTF files, so that nodes move between these times, in "
                 "seconds (bvhrender --shutter takes the picture)")
      ->check(CLI::Validator(check_shutter, ""))
      ->type_name("OPEN,CLOSE");
  app.add_option("--motion-keys", command.motion_keys,
                 "Keys of what moves, evenly from OPEN to CLOSE, 2 to 4096. Rotations take the shorter way from one to "
                 "the next")
      ->check(CLI::Range(2u, 4096u))
      ->type_name("N")
      ->needs("--shutter")
      ->capture_default_str();
  app.add_option("--instance-bounds", command.instance_bounds,
                 "What the box of an instance is made of, transformed: the object's root, the boxes of its children or "
                 "grandchildren, or all its primitives. Smaller boxes take longer to make")
      ->check(CLI::IsMember(words(kInstanceBounds)))
      ->type_name("NAME")
      ->excludes("--flatten")
      ->capture_default_str();
}

/// --refit, which goes with none of the options of a build.
void add_refit_option(CLI::App& app, BuildCommand& command) {
  CLI::Option* refit = app.add_option("--refit", command.moved,
                                      "Do not build: write INPUT, a BVH file, with its triangles or shapes where they "
                                      "are in this file. Once per "
                                      "geometry, in their order. Says whether a rebuild is advised")
                           ->allow_extra_args(false)
                           ->type_name("MESH");
  for (const char* name :
       {"--builder",     "--quality",     "--import",         "--nodes",           "--target",
        "--device",      "--max-leaf",    "--split-budget",   "--presplit-budget", "--reinsertion-rounds",
        "--ploc-radius", "--no-pairs",    "--stats",          "--instances",       "--flatten",
        "--shutter",     "--motion-keys", "--opening-budget", "--levels",          "--instance-bounds"})
    refit->excludes(app.get_option(name));
}

/// What single options cannot know of each other.
void check_command(const CLI::App& app, BuildCommand& command) {
  command.builder_given = app.get_option("--builder")->count() != 0;
  if (!command.moved.empty() && command.inputs.size() != 1)
    throw CLI::ValidationError("--refit takes one INPUT, a BVH file; there are " +
                               std::to_string(command.inputs.size()));
  if (!command.moved.empty()) return;
  for (const std::string& input : command.inputs)
    if (is_scene_file(input) && (command.instances || command.inputs.size() != 1))
      throw CLI::ValidationError(
          input + " is a scene, which " +
          (command.instances ? "--instances does not take"
                             : "has to be the only INPUT; there are " + std::to_string(command.inputs.size())));
  if (!command.shutter.empty() && !command.instances)
    throw CLI::ValidationError("--shutter goes with --instances; scenes of JSON have motions of their own");
  if (command.is_scene()) {
    if (!command.imported.empty()) throw CLI::ValidationError("--import takes meshes, not a scene of instances");
    return;
  }
  for (const char* name : {"--flatten", "--instance-bounds", "--opening-budget", "--levels"})
    if (app.get_option(name)->count() != 0)
      throw CLI::ValidationError(std::string(name) +
                                 " takes a scene of instances: a .json or .scene file, or --instances");
}

}  // namespace

bool is_scene_json(const std::string& path) { return ends_with(path, ".json"); }

bool is_scene_file(const std::string& path) { return is_scene_json(path) || ends_with(path, ".scene"); }

std::vector<float> BuildCommand::motion_times() const {
  std::vector<float> times;
  if (shutter.empty()) return times;
  const Shutter open = *parse_shutter(shutter);
  if (!(open.open < open.close)) return {open.open};
  for (unsigned i = 0; i < motion_keys; ++i) {
    const double s = static_cast<double>(i) / (motion_keys - 1);
    const auto time =
        static_cast<float>((1 - s) * static_cast<double>(open.open) + s * static_cast<double>(open.close));
    // Closer than floats are: fewer keys.
    if (times.empty() || time > times.back()) times.push_back(time);
  }
  return times;
}

bool BuildCommand::is_scene() const { return instances || (inputs.size() == 1 && is_scene_file(inputs[0])); }

void add_build_options(CLI::App& app, BuildCommand& command) {
  add_file_options(app, command);
  add_builder_options(app, command);
  add_target_options(app, command);
  add_tree_options(app, command);
  add_scene_options(app, command);
  add_refit_option(app, command);
  app.callback([&app, &command] { check_command(app, command); });
}

build::BuildOptions build_options(const BuildCommand& command, std::string_view tool,
                                  build::ProgressCallback progress) {
  build::BuildOptions result = command.quality.empty()
                                   ? build::BuildOptions{.builder = value_of(kBuilders, command.builder)}
                                   : build::options_for(value_of(kQualities, command.quality));
  result.nodes = command.nodes == "auto" ? value_of(kTargetLayouts, command.target) : value_of(kLayouts, command.nodes);
  result.threads = command.threads;
  result.max_leaf_triangles = command.max_leaf;
  result.presplit_budget = command.presplit_budget;
  if (command.split_budget) result.split_budget = command.split_budget;
  result.ploc_radius = command.ploc_radius;
  if (command.rounds) result.reinsertion_rounds = command.rounds;
  result.pair_triangles = !command.no_pairs;
  result.tool = tool;
  result.progress = std::move(progress);
  return result;
}

}  // namespace hiprt::tools
