#include <tools/query/query_command.h>

#include <tools/base/text.h>
#include <tools/cli/cli.h>

#include <CLI/CLI.hpp>

#include <array>

namespace hiprt::tools {
namespace {

constexpr std::uint32_t kMostNearest = 1024;

std::string check_reach(const std::string& text) {
  const auto distance = parse_real<float>(text);
  return distance && *distance >= 0.0f ? std::string() : in_quotes(text) + " is not a distance of 0 or more";
}

void add_input_options(CLI::App& app, QueryCommand& command) {
  app.add_option("FILE", command.path, "BVH file to ask")->required()->type_name("")->group(kInputGroup);
  CLI::Option* const points =
      app.add_option("--points", command.points, "File of points")->type_name("FILE")->group(kInputGroup);
  CLI::Option* const spheres =
      app.add_option("--spheres", command.spheres,
                     "File of spheres. Also points with a largest distance of their own: the radius")
          ->type_name("FILE")
          ->group(kInputGroup);
  CLI::Option* const boxes =
      app.add_option("--boxes", command.boxes, "File of boxes")->type_name("FILE")->group(kInputGroup);
  CLI::Option* const slice =
      app.add_option("--slice", command.slice,
                     "Draw the distances on a plane: x, y or z (through the middle), or for example z=0.5")
          ->check(CLI::Validator(check_plane, ""))
          ->type_name("PLANE")
          ->group(kInputGroup);
  const std::array<CLI::Option*, 4> all{points, spheres, boxes, slice};
  for (CLI::Option* const one : all)
    for (CLI::Option* const other : all)
      if (one != other) one->excludes(other);
}

void add_question_options(CLI::App& app, QueryCommand& command) {
  constexpr const char* kGroup = "Query";
  app.add_option("--query", command.query,
                 "What to find. auto: closest of points, overlaps of spheres and boxes, signed for --slice")
      ->check(CLI::IsMember(words(kQueryKinds, {"auto"})))
      ->type_name("NAME")
      ->capture_default_str()
      ->group(kGroup);
  app.add_option("--sign", command.sign,
                 "signed and inside: what decides. crossings of a ray, exact for closed meshes; winding numbers, for "
                 "meshes with holes")
      ->check(CLI::IsMember(words(kSignKinds)))
      ->type_name("NAME")
      ->capture_default_str()
      ->group(kGroup);
  app.add_option("-k,--nearest", command.nearest, "nearest: how many triangles. Fast up to about 64")
      ->check(CLI::Range(1u, kMostNearest))
      ->type_name("K")
      ->capture_default_str()
      ->group(kGroup);
  app.add_option("--max-distance", command.max_distance, "Triangles farther than this do not count")
      ->check(CLI::Validator(check_reach, ""))
      ->type_name("D")
      ->group(kGroup);
  app.add_option("--time", command.time, "Time of all queries, for scenes that move")
      ->type_name("T")
      ->capture_default_str()
      ->group(kGroup);
}

void add_output_options(CLI::App& app, QueryCommand& command) {
  app.add_option("-o,--output", command.output, "File of results to write; with --slice a picture, .exr or .png")
      ->required()
      ->type_name("FILE")
      ->group(kOutputGroup);
  app.add_option("--paths", command.paths, "File of paths to write: the instances that lead to each result")
      ->type_name("FILE")
      ->group(kOutputGroup);
  app.add_option("--size", command.size, "Width and height of the picture in pixels")
      ->check(CLI::Validator(check_size, ""))
      ->type_name("WxH")
      ->capture_default_str()
      ->group(kOutputGroup);
}

/// Options that only some queries have.
void check_query(const CLI::App& app, const QueryCommand& command) {
  const QueryKind kind = command.kind();
  const QueryShape shape = command.shape();
  const std::string name = word_of(kQueryKinds, kind);
  if (!can_ask(shape, kind))
    throw CLI::ValidationError("--query " + name + " does not go with " + plural(shape) +
                               (shape == QueryShape::kBox ? ": use overlaps or any-overlap" : ""));
  if (app.count("--nearest") != 0 && kind != QueryKind::kNearest)
    throw CLI::ValidationError("--nearest goes with --query nearest");
  if (app.count("--max-distance") != 0 && (shape != QueryShape::kPoint || kind == QueryKind::kInside))
    throw CLI::ValidationError("--max-distance goes with distances of points: spheres have their radius");
  if (!command.paths.empty() && kind == QueryKind::kInside)
    throw CLI::ValidationError("--paths does not go with --query inside: no triangle is found");
  if (kind == QueryKind::kWithin && shape == QueryShape::kPoint && app.count("--max-distance") == 0)
    throw CLI::ValidationError("--query within needs --max-distance, or --spheres");
}

}  // namespace

QueryShape QueryCommand::shape() const {
  return !boxes.empty() ? QueryShape::kBox : !spheres.empty() ? QueryShape::kSphere : QueryShape::kPoint;
}

const std::string& QueryCommand::input() const { return !boxes.empty() ? boxes : !spheres.empty() ? spheres : points; }

QueryKind QueryCommand::kind() const {
  if (query != "auto") return value_of(kQueryKinds, query);
  if (is_slice()) return QueryKind::kSigned;
  return shape() == QueryShape::kPoint ? QueryKind::kClosest : QueryKind::kOverlaps;
}

void add_query_options(CLI::App& app, QueryCommand& command) {
  add_input_options(app, command);
  add_question_options(app, command);
  add_output_options(app, command);
  add_threads_option(app, command.threads);
  add_memory_option(app, command.max_memory);
}

bool QueryCommand::uses_winding() const { return value_of(kSignKinds, sign) == SignKind::kWinding; }

void check_query_command(const CLI::App& app, const QueryCommand& command) {
  if (!command.is_slice() && command.input().empty())
    throw CLI::RequiredError("--points, --spheres, --boxes or --slice");
  if (app.count("--sign") != 0 && command.kind() != QueryKind::kSigned && command.kind() != QueryKind::kInside)
    throw CLI::ValidationError("--sign goes with --query signed or inside");
  if (!command.is_slice()) {
    if (app.count("--size") != 0) throw CLI::ValidationError("--size goes with --slice");
    return check_query(app, command);
  }
  const QueryKind kind = command.kind();
  if (kind != QueryKind::kSigned && kind != QueryKind::kClosest)
    throw CLI::ValidationError("--slice goes with --query signed or closest");
  if (!command.paths.empty()) throw CLI::ValidationError("--slice does not go with --paths");
  if (app.count("--nearest") != 0) throw CLI::ValidationError("--nearest goes with --query nearest");
  if (const std::string fault = check_picture_name(command.output); !fault.empty())
    throw CLI::ValidationError("--output: " + fault);
}

}  // namespace hiprt::tools
