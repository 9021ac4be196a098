#!/bin/busybox sh
# What runs in the machine of socketcan_session.sh, as its first process: candump and cansend play
# the master of an encoder, on a virtual interface and on two controllers that share a bus.
#
# Each step prints a line, `ok` or `FAILED`; the verdict ends the machine.
# shellcheck shell=busybox

export PATH=/tools:/bin LD_LIBRARY_PATH=/lib/x86_64-linux-gnu:/usr/lib/x86_64-linux-gnu
/bin/busybox --install -s /bin
mount -t proc proc /proc
mount -t sysfs sys /sys
mount -t devtmpfs dev /dev
# This shell takes its own ip before any other, and that one knows no CAN.
ip() { /tools/ip "$@"; }
# So that a message can be typed as it stands.
sudo() { "$@"; }

verdict=0

# Ends the machine; QEMU ends with 2·verdict + 1.
end() {
    printf "\\$(printf %o "$verdict")" | dd of=/dev/port bs=1 seek=$((0xf4)) 2>/dev/null
    poweroff -f
}

ok() { echo "ok      $*"; }

failed() {
    echo "FAILED  $*"
    verdict=1
    for file in /tmp/bus /tmp/err /tmp/out; do
        echo "    $file:"
        tail -n 25 "$file" 2>/dev/null | sed 's/^/      /'
    done
    end
    sleep 60
}

# Waits until $1 holds line $2 ($3 times or more, by default once), at most 10 s.
until_said() {
    tries=0
    while [ "$(grep -c -E -e "$2" "$1" 2>/dev/null || true)" -lt "${3:-1}" ]; do
        tries=$((tries + 1))
        [ $tries -lt 200 ] || failed "no '$2' in $1"
        sleep 0.05
    done
}

# Listens on interface $1 into /tmp/bus, also when it goes down meanwhile; candump writes frames as
# 3C5#00100000.
listen() {
    : >/tmp/bus
    candump -L -D "$1" >>/tmp/bus 2>/dev/null &
    listener=$!
    # Until it is there, nothing is said.
    until_said /proc/net/can/rcvlist_all "$1"
}

# Starts the encoder on bus $1 with further arguments, and waits until it is ready.
start() {
    bus=$1
    shift
    codewheel encoder amg11-d29 --bus "$bus" --address 5 --shaft 'still angle=100000' -v "$@" \
        >/tmp/out 2>/tmp/err &
    encoder=$!
    until_said /tmp/out "^ready amg11-d29 address 5 on $bus\$"
}

stop() {
    kill -TERM $encoder
    wait $encoder || failed "the encoder left with $?"
    kill $listener
    wait $listener 2>/dev/null
}

# What the encoder says when it cannot use bus $1.
refusal() {
    bus=$1
    shift
    if codewheel encoder amg11-d29 --bus "$bus" --address 5 "$@" 2>/tmp/err >/tmp/out; then
        failed "$bus was taken"
    else
        left=$?
    fi
    [ $left = 3 ] || failed "$bus was refused with exit code $left instead of 3"
    cat /tmp/err
}

# Types what message $1 says is to be typed.
type_it() {
    command=$(echo "$1" | tr '\n' ' ' | sed -n 's/.*type: //p' | sed 's/ *$//')
    [ -n "$command" ] || failed "nothing to type in: $1"
    eval "$command" 2>/tmp/typed || failed "'$command' failed with $?: $(cat /tmp/typed)"
}

# Sends frame $2 on interface $1 and waits for answer $3.
ask() {
    : >/tmp/bus
    cansend "$1" "$2"
    until_said /tmp/bus " $3"
}

# Allocates explicit and poll connections for master 1 on interface $1, and polls.
allocate_and_poll() {
    ask "$1" 42E#014B03010301 '42B#01CB00'
    ask "$1" 42C#0110050209E803 '42B#0190E803'
    # 100000 = 000186A0h, low octet first.
    ask "$1" 42D# '3C5#A0860100'
    ask "$1" 42D# '3C5#A0860100'
}

# BOI 1: after a bus-off the encoder is to come back by itself.
let_it_come_back() { ask "$1" 42C#011003010301 '42B#0190'; }

# Waits until the encoder has checked its address from the beginning of /tmp/bus on and is on-line.
on_line() {
    until_said /tmp/bus ' 42F#00' 2
    until_said /tmp/err 'on-line' "$1"
}

on_a_virtual_interface() {
    type_it "$(refusal socketcan:vcan0)"
    ok 'a missing virtual interface is there after typing what the refusal says'
    ip link set vcan0 down
    type_it "$(refusal socketcan:vcan0)"
    ok 'a virtual interface that is down is up after typing what the refusal says'
    listen vcan0
    start socketcan:vcan0
    on_line 1
    ok 'socketcan:vcan0: two duplicate MAC ID checks and on-line'
    allocate_and_poll vcan0
    ok 'cansend allocates and polls, candump sees position 100000'
    let_it_come_back vcan0
    : >/tmp/bus
    cansend vcan0 20000040#0000000000000000
    until_said /tmp/err 'bus-off'
    cansend vcan0 42D#
    sleep 0.3
    grep -q ' 3C5#' /tmp/bus && failed 'a poll was answered while bus-off'
    cansend vcan0 20000100#0000000000000000
    on_line 2
    allocate_and_poll vcan0
    ok 'a reported bus-off silences it, a restart makes it check its address anew and serve'
    let_it_come_back vcan0
    : >/tmp/bus
    ip link set vcan0 down
    until_said /tmp/err 'socketcan:vcan0 was lost: the interface went down'
    until_said /tmp/err 'not back yet: .*vcan0.* is down'
    ip link set vcan0 up
    until_said /tmp/err 'socketcan:vcan0 is back'
    kill -0 $encoder || failed 'the encoder ended'
    on_line 3
    allocate_and_poll vcan0
    ok 'an interface that goes down and up again is lost and taken again, the process lives on'
    stop
}

on_two_controllers() {
    type_it "$(refusal socketcan:can0 --baud 250k)"
    ok 'a controller that is down runs at 250 kbit/s after typing what the refusal says'
    type_it "$(refusal socketcan:can0 --baud 500k)"
    ip -details link show can0 | grep -q 'bitrate 500000' || failed 'can0 has another rate'
    ok 'a controller at another rate runs at 500 kbit/s after typing what the refusal says'
    ip link set can1 up type can bitrate 500000 restart-ms 100
    listen can1
    start socketcan:can0 --baud 500k
    on_line 1
    allocate_and_poll can1
    ok 'two controllers at 500 kbit/s: on-line, allocated and polled across the bus'
    for _ in $(seq 100); do cansend can1 42D#; done
    until_said /tmp/bus ' 3C5#A0860100' 100
    ok 'a hundred polls as fast as cansend starts are answered'
    let_it_come_back can1
    : >/tmp/bus
    ip link set can0 down
    until_said /tmp/err 'socketcan:can0 was lost: the interface went down'
    ip link set can0 up
    until_said /tmp/err 'socketcan:can0 is back'
    on_line 2
    allocate_and_poll can1
    ok 'a controller that is stopped and started again serves as before'
    stop
}

on_a_listening_controller() {
    ip link set can0 down
    ip link set can0 up type can bitrate 500000 listen-only on
    message=$(refusal socketcan:can0 --baud 500k)
    case $message in
    *'it only listens'*) ok 'a controller that only listens is refused' ;;
    *) failed "a controller that only listens: $message" ;;
    esac
}

while read -r module; do insmod "/modules/$module.ko" || failed "module $module"; done </modules/order
on_a_virtual_interface
on_two_controllers
on_a_listening_controller
end
