# ruff: noqa: E501
"""A small cell as XML of the published benchmark's form, made here; tests damage it."""

XML = """<?xml version="1.0" encoding="UTF-8"?>
<dataset>
  <name>made for tests</name>
  <instance>
    <robots>
      <robot>
        <name>left</name>
        <activities>
          <static-activity aid="0" last_in_cycle="true">
            <min-duration>0.5</min-duration>
            <max-duration>30</max-duration>
            <locations><location lid="0"><point>0</point></location></locations>
          </static-activity>
          <static-activity aid="1">
            <min-duration>1</min-duration>
            <max-duration>4</max-duration>
            <locations>
              <location lid="0"><point>1</point></location>
              <location lid="1">
                <point>2</point>
                <location-dependent-power-consumption><consumption pid="0" input_power="310"/></location-dependent-power-consumption>
              </location>
            </locations>
          </static-activity>
          <dynamic-activity aid="2">
            <movements from_aid="0" to_aid="1">
              <movement mid="0">
                <from-point>0</from-point><to-point>1</to-point>
                <min-duration>1.5</min-duration><max-duration>9</max-duration>
                <energy-function><monomial degree="-1" coeff="900"/><monomial degree="1" coeff="250"/></energy-function>
              </movement>
              <movement mid="1">
                <from-point>0</from-point><to-point>2</to-point>
                <min-duration>1.2</min-duration><max-duration>9</max-duration>
                <energy-function><monomial degree="-1" coeff="700"/><monomial degree="1" coeff="260"/></energy-function>
              </movement>
            </movements>
          </dynamic-activity>
          <dynamic-activity aid="3">
            <movements>
              <movement mid="0">
                <from-point>1</from-point><to-point>0</to-point>
                <min-duration>1.4</min-duration><max-duration>9</max-duration>
                <energy-function><monomial degree="-1" coeff="800"/><monomial degree="1" coeff="240"/></energy-function>
              </movement>
              <movement mid="1">
                <from-point>2</from-point><to-point>0</to-point>
                <min-duration>1.4</min-duration><max-duration>9</max-duration>
                <energy-function><monomial degree="-1" coeff="800"/><monomial degree="0" coeff="0"/><monomial degree="1" coeff="240"/></energy-function>
              </movement>
            </movements>
          </dynamic-activity>
        </activities>
        <power-saving-modes>
          <power-mode pid="0"><minimal-idle-time>0</minimal-idle-time><expected-input-power>300</expected-input-power></power-mode>
          <power-mode pid="1"><minimal-idle-time>2</minimal-idle-time><expected-input-power>150</expected-input-power></power-mode>
        </power-saving-modes>
      </robot>
      <robot>
        <name>right</name>
        <activities>
          <static-activity aid="4" last_in_cycle="true">
            <min-duration>0.5</min-duration>
            <max-duration>30</max-duration>
            <locations><location lid="0"><point>3</point></location></locations>
          </static-activity>
          <static-activity aid="5">
            <min-duration>1</min-duration>
            <max-duration>4</max-duration>
            <locations><location lid="0"><point>4</point></location></locations>
          </static-activity>
          <dynamic-activity aid="6">
            <movements>
              <movement mid="0">
                <from-point>3</from-point><to-point>4</to-point>
                <min-duration>1</min-duration><max-duration>9</max-duration>
                <energy-function><monomial degree="-1" coeff="600"/><monomial degree="1" coeff="250"/></energy-function>
              </movement>
            </movements>
          </dynamic-activity>
          <dynamic-activity aid="7">
            <movements>
              <movement mid="0">
                <from-point>4</from-point><to-point>3</to-point>
                <min-duration>1</min-duration><max-duration>9</max-duration>
                <energy-function><monomial degree="-1" coeff="600"/><monomial degree="1" coeff="250"/></energy-function>
              </movement>
            </movements>
          </dynamic-activity>
        </activities>
        <power-saving-modes>
          <power-mode pid="0"><minimal-idle-time>0</minimal-idle-time><expected-input-power>280</expected-input-power></power-mode>
        </power-saving-modes>
      </robot>
    </robots>
    <inter-robot-operations>
      <operation oid="0">
        <time-compatibility>
          <time-lag><from-activity>3</from-activity><to-activity>5</to-activity><length>0.5</length><height>0</height></time-lag>
          <time-lag><from-activity>7</from-activity><to-activity>1</to-activity><length>0</length><height>1</height></time-lag>
        </time-compatibility>
        <spatial-compatibility>
          <compatible-pair><location aid="5" lid="0"/><location aid="1" lid="0"/></compatible-pair>
          <compatible-pair><location aid="1" lid="1"/><location aid="5" lid="0"/></compatible-pair>
        </spatial-compatibility>
      </operation>
    </inter-robot-operations>
    <collision-zones>
      <collision-pair><location aid="1" lid="0"/><movement aid="6" mid="0"/></collision-pair>
    </collision-zones>
    <production-cycle-time>12</production-cycle-time>
  </instance>
</dataset>
"""
