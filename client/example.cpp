// Finds gears in one scan: example HOST:PORT gear.stl scan.ply, both in millimetres.
#include <iostream>

#include "client/client.h"
#include "client/read_file.h"
#include "client/scene.h"

namespace v1 = binpose::v1;

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  binpose::client::Client client(argv[1]);

  v1::TrainRequest part;
  part.set_id("gear");
  part.mutable_mesh()->set_data(binpose::client::read_file(argv[2]).value());
  part.mutable_mesh()->set_unit(v1::LENGTH_UNIT_MILLIMETRE);
  if (auto model = client.train(part); !model.ok()) return std::cerr << model.status() << '\n', 1;

  v1::DetectRequest scan;
  scan.add_model_ids("gear");
  *scan.mutable_cloud() = binpose::client::read_scene(argv[3], {}, v1::LENGTH_UNIT_MILLIMETRE).value();
  auto answer = client.detect(scan);
  if (!answer.ok()) return std::cerr << answer.status() << '\n', 1;
  for (const v1::PoseHypothesis& found : answer->hypotheses()) {
    const v1::Vector3& position = found.pose().position();
    std::cout << found.score() << ": " << position.x() << ' ' << position.y() << ' ' << position.z() << " mm\n";
  }
}
