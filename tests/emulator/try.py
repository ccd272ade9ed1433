import sys, time
from machine import *
from model import camera, clocks, core, i2c, timer, usart
from model.registers import Registers
m = Machine(sys.argv[1])
mux = Registers(camera.DMAMUX1)
dma = camera.Dma(m, mux); dcmi = camera.Dcmi(dma)
sensor = i2c.Sensor(0x21, {0x0A: 0x77, 0x0B: 0x21})
line = usart.Usart(m, 2)
m.add(core.Nvic(m), core.Scb(m), *clocks.all_of_them(), mux, dma, dcmi, i2c.I2c([sensor]), timer.Timer(m), line)
m.add(*[Registers(0x58020000 + 0x400*k) for k in range(11)])
m.add(*[Registers(a) for a in (0xE000E400, 0x58000400, 0x5C001000, 0x58000000, 0x40020400, 0x58025400, 0x58025800, 0x52000000)])
raw = open('/tmp/h743/clip.raw','rb').read()
clip = [raw[k:k+76800] for k in range(0, len(raw), 76800)]
cam = camera.Camera(m, sensor, dcmi, clip, (320,240), 3200000)
m.count_instructions()
t=time.time()
try:
    m.run(lambda: cam.frame is not None and cam.frame >= int(sys.argv[2]))
except Stopped as e:
    print('stopped', e)
print(time.time()-t, 's', m.now/96e6, 'virtual s', cam.frame, m.instructions)
print(bytes(line.sent).hex(' ')[:3000])
print(sensor.registers)
