#include <tools/cli/build/build_command.h>

#include <tools/base/text.h>
#include <tools/build/bvh_cache.h>
#include <tools/cli/build/build_names.h>
#include <tools/cli/cli.h>
#include <tools/cli/trace_device.h>
#include <tools/parts/part_manifest.h>
#include <tools/render/scene/shutter.h>
#include <tools/scene_io/scene/scene_file.h>

#include <hiprt_device/format/widened_boxes.h>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cctype>
#include <string_view>
#include <utility>

namespace hiprt::tools {
namespace {

std::string check_prune_limit(const std::string& text) {
  if (parse_prune_limit(text)) return {};
  return in_quotes(text) + " is no limit: expected a size such as 20G or a time such as 30d";
}

void add_file_options(CLI::App& app, BuildCommand& command) {
  app.add_option("INPUT", command.inputs,
                 "Files of meshes or shapes, one geometry each, or one scene file (.json, .scene). With --refit: one "
                 "BVH file")
      ->type_name("FILE")
      ->group(kInputGroup);
  app.add_option("-o,--output", command.output, "BVH file to write")->type_name("FILE")->group(kOutputGroup);
  app.add_flag("--stats", command.stats, "Print statistics of the tree, times and memory")
      ->disable_flag_override()
      ->group(kOutputGroup);
}

void add_tree_options(CLI::App& app, BuildCommand& command) {
  app.add_option("--quality", command.quality,
                 "Choose the builder and its options. fast: lbvh, the fastest build. balanced: sbvh, rays nearly as "
                 "fast as with high. high: hq, the fastest rays")
      ->check(CLI::IsMember(words(kQualities)))
      ->type_name("WORD")
      ->group(kTreeGroup);
  app.add_option("--builder", command.builder,
                 "Choose the builder itself. lbvh builds fastest, hq gives the fastest rays. lbvh30 and ploc are for "
                 "comparisons, embree-* are Embree's builders")
      ->check(CLI::IsMember(words(kBuilders)))
      ->type_name("NAME")
      ->excludes("--quality")
      ->capture_default_str()
      ->group(kTreeGroup);
  app.add_option(
         "--target", command.target,
         "Machine to trace on. It chooses the node layout (cpu and nvidia: planes, amd: float). amd: layouts float "
         "and half get boxes that are wide enough for the ray instruction of its GPUs")
      ->check(CLI::IsMember(words(kTargetLayouts)))
      ->type_name("NAME")
      ->capture_default_str()
      ->group(kTreeGroup);
  app.add_option("--nodes", command.nodes,
                 "Node layout. auto: as --target says. half and quantized nodes take half the memory; their boxes are "
                 "rounded outwards")
      ->check(CLI::IsMember(words(kLayouts, {"auto"})))
      ->type_name("NAME")
      ->capture_default_str()
      ->group(kTreeGroup);
}

void add_instance_options(CLI::App& app, BuildCommand& command) {
  app.add_flag("--instances", command.instances,
               "Build a scene of instances: every glTF mesh is one object and its nodes are the instances. Every other "
               "file is an object with one instance")
      ->disable_flag_override()
      ->group(kInstanceGroup);
  app.add_flag("--flatten", command.flatten,
               "Build one BVH without instances: every instance of a mesh becomes a geometry in the scene's space")
      ->disable_flag_override()
      ->group(kInstanceGroup);
  app.add_option("--parts", command.parts,
                 "Distribute the instances to N files of about equal memory, for bvhrender on several machines. "
                 "--output is their manifest, a .json file; the parts lie next to it. Materials of the inputs go with "
                 "them")
      ->check(CLI::Range(1u, 65536u))
      ->type_name("N")
      ->excludes("--flatten")
      ->group(kInstanceGroup);
  app.add_option("--shutter", command.shutter,
                 "With --instances: read the animations of glTF files between these times, in seconds (see bvhrender "
                 "--shutter)")
      ->check(CLI::Validator(check_shutter, ""))
      ->type_name("OPEN,CLOSE")
      ->group(kInstanceGroup);
  app.add_option("--motion-keys", command.motion_keys,
                 "Keys per moving node, evenly from OPEN to CLOSE, 2 to 4096. Rotations take the shorter arc between "
                 "two keys")
      ->check(CLI::Range(2u, 4096u))
      ->type_name("N")
      ->needs("--shutter")
      ->capture_default_str()
      ->group(kInstanceGroup);
}

/// Options of the trees over instances.
void add_instance_tree_options(CLI::App& app, BuildCommand& command) {
  app.add_option("--levels", command.levels,
                 "Most levels of instances to keep, 1 to 4096. Deeper groups are replaced by their own instances: rays "
                 "are faster, files are larger. Moving groups stay (default: all levels)")
      ->check(CLI::Range(1u, 4096u))
      ->type_name("N")
      ->excludes("--flatten")
      ->group(kInstanceGroup);
  app.add_option("--opening-budget", command.opening_budget,
                 "Most leaves per instance in trees over instances, on average, 1 to 64. Above 1 instances are opened "
                 "where rays gain by it: rays enter parts of their objects")
      ->check(CLI::Range(1.0, 64.0))
      ->type_name("X")
      ->excludes("--flatten")
      ->capture_default_str()
      ->group(kInstanceGroup);
  app.add_flag("--open-largest", command.open_largest,
               "Open the largest instances, whatever rays gain by it. For large instances that lie in each other")
      ->needs("--opening-budget")
      ->group(kInstanceGroup);
  app.add_option("--instance-bounds", command.instance_bounds,
                 "What the box of an instance encloses after the transform: the box of the object's root, the boxes of "
                 "its children or grandchildren, or all primitives. Smaller boxes take longer to compute")
      ->check(CLI::IsMember(words(kInstanceBounds)))
      ->type_name("NAME")
      ->excludes("--flatten")
      ->capture_default_str()
      ->group(kInstanceGroup);
}

void add_machine_options(CLI::App& app, BuildCommand& command) {
  app.add_option("--device", command.device,
                 "Processor that builds. gpu: every builder except embree-* and --import. "
                 "auto: the GPU if there is one that has the builder, else the CPU")
      ->check(CLI::IsMember(words(kDeviceChoices)))
      ->type_name("NAME")
      ->capture_default_str()
      ->group(kMachineGroup);
  add_threads_option(app, command.threads);
  add_memory_option(app, command.max_memory);
}

/// "auto", or a number.
std::string read_split_budget(std::string& text) {
  if (text == "auto") {
    static_assert(build::kSplitsAsNeeded == 0.0);
    text = "0";
    return {};
  }
  return CLI::Range(1.0, 16.0)(text).empty() ? "" : in_quotes(text) + " is no split budget: expected 1 to 16, or auto";
}

void add_expert_options(CLI::App& app, BuildCommand& command) {
  app.add_option("--max-leaf", command.max_leaf, "Most triangles below one leaf reference, 1 to 64")
      ->check(CLI::Range(1u, 64u))
      ->type_name("N")
      ->capture_default_str()
      ->group(kExpertGroup);
  app.add_option("--split-budget", command.split_budget,
                 "References per primitive that spatial splits may create, on average, 1 to 16. For sbvh, hq and "
                 "embree-high (default: 3 for hq, 1.5 for the others). auto: up to 8 with sbvh and hq, where boxes are "
                 "much larger than their triangles")
      ->transform(CLI::Validator(read_split_budget, ""))
      ->type_name("X")
      ->group(kExpertGroup);
  app.add_option("--presplit-budget", command.presplit_budget,
                 "References per primitive that splits before the build may create, on average, 1 to 16. For hploc "
                 "with reinsertion rounds")
      ->check(CLI::Range(1.0, 16.0))
      ->type_name("X")
      ->capture_default_str()
      ->group(kExpertGroup);
  app.add_option("--reinsertion-rounds", command.rounds,
                 "Rounds of reinsertion, 0 to 1000: each round moves up to an eighth of the nodes to better positions "
                 "(default: 32 for hq, fewer where splits more than double the references; 0 for others)")
      ->check(CLI::Range(0u, 1000u))
      ->type_name("N")
      ->group(kExpertGroup);
  app.add_option("--ploc-radius", command.ploc_radius, "Search radius of ploc and hploc in clusters, 1 to 128")
      ->check(CLI::Range(1u, 128u))
      ->type_name("N")
      ->capture_default_str()
      ->group(kExpertGroup);
  app.add_flag("--no-pairs", command.no_pairs, "Do not store two triangles that share an edge in one leaf")
      ->disable_flag_override()
      ->group(kExpertGroup);
  app.add_option("--import", command.imported,
                 "Encode the tree of this JSON file instead of building one (bvhinfo --export writes such files)")
      ->type_name("FILE")
      ->excludes("--builder")
      ->excludes("--quality")
      ->group(kExpertGroup);
}

void add_cache_options(CLI::App& app, BuildCommand& command) {
  app.add_option("--cache", command.cache,
                 "Folder of built files. An object whose geometry and options are in it is not built again; the others "
                 "are added")
      ->type_name("DIR")
      ->group(kCacheGroup);
  app.add_option("--manifest", command.manifest,
                 "Build the assets of this JSON file into --cache, without INPUT and --output. Under mpirun all ranks "
                 "share the work")
      ->type_name("FILE")
      ->needs("--cache")
      ->group(kCacheGroup);
  app.add_option("--prune", command.prune,
                 "Remove files of --cache: with 20G (or K, M, T) the files that were used last stay, up to this size; "
                 "with 30d (or 12h) files go that were not used for so long. Files in use stay")
      ->check(CLI::Validator(check_prune_limit, ""))
      ->type_name("LIMIT")
      ->needs("--cache")
      ->group(kCacheGroup);
  app.add_flag("--lossy-ranks", command.lossy_ranks,
               "With --manifest: go on after ranks were lost. Start it with mpirun --enable-recovery "
               "(Open MPI 5 and newer: --with-ft ulfm)")
      ->needs("--manifest")
      ->disable_flag_override()
      ->group(kCacheGroup);
}

/// --refit excludes all options of a build.
void add_refit_option(CLI::App& app, BuildCommand& command) {
  CLI::Option* refit = app.add_option("--refit", command.moved,
                                      "Do not build: refit the BVH file INPUT to the moved triangles or shapes of this "
                                      "file. Once per geometry, in their order. Prints whether a rebuild is advised")
                           ->allow_extra_args(false)
                           ->type_name("MESH")
                           ->group(kInputGroup);
  for (const char* name :
       {"--builder",         "--quality",     "--import",         "--nodes",           "--target",
        "--device",          "--max-leaf",    "--split-budget",   "--presplit-budget", "--reinsertion-rounds",
        "--ploc-radius",     "--no-pairs",    "--stats",          "--instances",       "--flatten",
        "--shutter",         "--motion-keys", "--opening-budget", "--open-largest",    "--levels",
        "--instance-bounds", "--cache",       "--parts"})
    refit->excludes(app.get_option(name));
}

/// Options that build something else than the assets of a manifest.
void check_farm(const CLI::App& app, const BuildCommand& command) {
  const std::string farm = command.manifest.empty() ? "--prune" : "--manifest";
  if (!command.inputs.empty()) throw CLI::ValidationError(farm + " takes no INPUT: it names the assets itself");
  for (const char* name : {"--output", "--import", "--refit", "--instances", "--flatten", "--shutter", "--levels",
                           "--opening-budget", "--instance-bounds", "--parts"})
    if (app.get_option(name)->count() != 0) throw CLI::ValidationError(farm + " excludes " + name);
}

/// Checks that involve several options.
void check_command(const CLI::App& app, BuildCommand& command) {
  if (!command.manifest.empty() || (!command.prune.empty() && command.inputs.empty())) return check_farm(app, command);
  if (!command.prune.empty()) throw CLI::ValidationError("--prune goes alone or with --manifest, not with INPUT");
  if (command.inputs.empty()) throw CLI::RequiredError("INPUT");
  if (command.output.empty()) throw CLI::RequiredError("--output");
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
    if (command.parts != 0 && !is_part_manifest(command.output))
      throw CLI::ValidationError("--parts writes a manifest: --output has to end with .json");
    return;
  }
  for (const char* name : {"--flatten", "--instance-bounds", "--opening-budget", "--levels", "--parts"})
    if (app.get_option(name)->count() != 0)
      throw CLI::ValidationError(std::string(name) +
                                 " takes a scene of instances: a .json or .scene file, or --instances");
}

}  // namespace

std::vector<float> BuildCommand::motion_times() const {
  std::vector<float> times;
  if (shutter.empty()) return times;
  const Shutter open = *parse_shutter(shutter);
  if (!(open.open < open.close)) return {open.open};
  for (unsigned i = 0; i < motion_keys; ++i) {
    const double s = static_cast<double>(i) / (motion_keys - 1);
    const auto time =
        static_cast<float>((1 - s) * static_cast<double>(open.open) + s * static_cast<double>(open.close));
    // Keys that are the same float are merged.
    if (times.empty() || time > times.back()) times.push_back(time);
  }
  return times;
}

bool BuildCommand::is_scene() const { return instances || (inputs.size() == 1 && is_scene_file(inputs[0])); }

void add_build_options(CLI::App& app, BuildCommand& command) {
  add_file_options(app, command);
  add_tree_options(app, command);
  add_instance_options(app, command);
  add_instance_tree_options(app, command);
  add_machine_options(app, command);
  add_expert_options(app, command);
  add_cache_options(app, command);
  add_refit_option(app, command);
  app.callback([&app, &command] { check_command(app, command); });
}

BuildRequest make_request(const BuildCommand& command, std::string_view tool) {
  BuildRequest result{command.quality.empty() ? build::BuildOptions{.builder = value_of(kBuilders, command.builder)}
                                              : build::options_for(value_of(kQualities, command.quality))};
  build::BuildOptions& options = result.options;
  options.nodes =
      command.nodes == "auto" ? value_of(kTargetLayouts, command.target) : value_of(kLayouts, command.nodes);
  options.widen_boxes =
      command.target == "amd" && (command.flatten || !command.is_scene()) && may_be_widened(options.nodes);
  options.threads = command.threads;
  options.max_leaf_triangles = command.max_leaf;
  options.presplit_budget = command.presplit_budget;
  if (command.split_budget) options.split_budget = command.split_budget;
  options.ploc_radius = command.ploc_radius;
  if (command.rounds) options.reinsertion_rounds = command.rounds;
  options.pair_triangles = !command.no_pairs;
  options.tool = tool;
  result.instances.opening_budget = command.opening_budget;
  result.instances.open_largest = command.open_largest;
  result.instances.bounds = value_of(kInstanceBounds, command.instance_bounds);
  result.device = value_of(kDeviceChoices, command.device);
  result.tree_path = command.imported;
  return result;
}

}  // namespace hiprt::tools
