#!/bin/bash
# network_spaces.sh MPIRUN WORD...: runs mpirun in a network space of its own, and rank 0 and rank 1 in two others with
# host names of their own, joined by virtual cables (veth) and a bridge. WORD... are mpirun's last options and the
# program. Exit status: mpirun's; 77: the machine does not permit it.
set -u
name=hiprt-test-$$
agent=$(mktemp) || exit 77
cleanup() {
  for i in 0 1 2; do ip netns del "$name-$i" 2>/dev/null; done
  rm -f "$agent"
}
trap cleanup EXIT
trap 'exit 143' TERM INT

build() {
  for i in 0 1 2; do
    ip netns add "$name-$i" && ip -n "$name-$i" link set lo up || return 1
  done
  ip -n "$name-0" link add bridge type bridge && ip -n "$name-0" link set bridge up &&
    ip -n "$name-0" addr add 10.77.0.1/24 dev bridge || return 1
  for i in 1 2; do
    ip link add cable netns "$name-$i" type veth peer name "cable$i" netns "$name-0" &&
      ip -n "$name-0" link set "cable$i" master bridge up &&
      ip -n "$name-$i" addr add "10.77.0.$((i + 1))/24" dev cable && ip -n "$name-$i" link set cable up || return 1
  done
}
build 2>/dev/null || exit 77

# mpirun starts this instead of ssh: HOST COMMAND...
cat >"$agent" <<AGENT
#!/bin/bash
host=\$1
shift
number=\$((\${host##*.} - 1))
exec ip netns exec $name-\$number unshare --uts bash -c "hostname space\$number; \$*"
AGENT
chmod +x "$agent"

mpirun=$1
shift
ip netns exec "$name-0" "$mpirun" --mca plm rsh --mca plm_rsh_agent "$agent" --mca oob_tcp_if_include 10.77.0.0/24 \
  --mca btl tcp,self --mca btl_tcp_if_include 10.77.0.0/24 --host 10.77.0.2:1,10.77.0.3:1 -n 2 "$@" &
wait $!
