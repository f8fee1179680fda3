#!/bin/bash
# The guest's first process: mounts, modules, devices, then the cases, then off.
export PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LANG=C.UTF-8
mount -t tmpfs tmpfs /run; mount -t tmpfs tmpfs /tmp
mkdir -p /dev/pts /dev/shm /run/lock /run/dbus /run/udev /var/lib/dbus
mount -t devpts devpts /dev/pts; mount -t tmpfs shm /dev/shm
hostname orbtouch-test; ip link set lo up
modprobe 9p; modprobe 9pnet_virtio
options=trans=virtio,version=9p2000.L,msize=262144
mount -t 9p -o $options,ro repo /repo || echo "no repo"
mount -t 9p -o $options out /out || echo "no out"
# The ciphers first: the kernel looks for them while it starts a controller, and would give up.
for module in virtio_rng af_alg algif_hash algif_skcipher cmac ecb ecdh_generic drbg ctr hmac \
    sha256_generic sha512_generic ccm bluetooth rfcomm hidp bnep hci_vhci uinput uhid evdev \
    joydev hid_generic; do
  modprobe $module 2>/dev/null
done
/lib/systemd/systemd-udevd --daemon 2>/dev/null
udevadm trigger >/dev/null 2>&1
dbus-uuidgen --ensure
cp -r /repo/. /project/
cd /project
export PYTHONPATH=/project:/opt/py PYTHONUNBUFFERED=1 SDL_VIDEODRIVER=dummy SDL_AUDIODRIVER=dummy \
  PYGAME_HIDE_SUPPORT_PROMPT=1 OMP_NUM_THREADS=1
echo "guest ready after $(cut -d' ' -f1 /proc/uptime) s"
/usr/bin/python3 -m tests.system.guest $(cat /out/cases)
sync
echo o > /proc/sysrq-trigger
sleep 10
